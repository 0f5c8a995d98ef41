#include "render/kernel/kernel_scene.h"

#include <Imath/ImathBoxAlgo.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "levelset/vdb.h"
#include "render/kernel/csg_walk.h"

namespace render {
namespace {

using Imath::M44d;
using Imath::V3d;

constexpr double kBesideBox = 0.0625;  // lest rounding loses a crossing on a face of the box
constexpr double kParallel = 1e30;
constexpr std::size_t kRaysAtOnce = 1u << 18;
constexpr double kNoEnd = 1e300;

Imath::Box3d cellBox(const BrickPool& pool) {
  Imath::Box3d box;
  for (const std::array<int, 3>& corner : {pool.low, pool.high})
    box.extendBy(V3d(corner[0], corner[1], corner[2]));
  return box;
}

/// A part of a ray, by its parameter.
struct Span {
  double enter, leave;
};

Span clipped(const BrickPool& pool, const V3d& origin, const V3d& direction, double reach) {
  Span span{0, reach};
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double inverse = std::abs(direction[a]) < 1 / kParallel ? kParallel : 1 / direction[a];
    const double t0 = (pool.low[i] - kBesideBox - origin[a]) * inverse,
                 t1 = (pool.high[i] + kBesideBox - origin[a]) * inverse;
    span.enter = std::max(span.enter, std::min(t0, t1));
    span.leave = std::min(span.leave, std::max(t0, t1));
  }
  return span;
}

/// Rays of a list that come near a solid, as its kernel takes them.
struct PackedRays {
  std::vector<std::size_t> number;  // in the list
  std::vector<double> enter;        // where they start, voxels along the ray
  RayBlock block{0};

  /// @param asked   numbers of the rays
  /// @param hasEnd  do they end at their reach, or go on as far as there is surface?
  PackedRays(const KernelSolid& solid, const std::vector<LightRay>& rays,
             const std::vector<std::size_t>& asked, bool hasEnd) {
    struct Ready {
      V3d origin, direction;
      Span span;
    };
    std::vector<Ready> ready;
    for (const std::size_t i : asked) {
      // A step of t is a voxel, so that single precision suits whatever the unit is.
      V3d origin, direction;
      solid.worldToTable.multVecMatrix(rays[i].origin, origin);
      solid.worldToTable.multDirMatrix(rays[i].direction * solid.voxelSize, direction);
      const double reach = hasEnd ? rays[i].reach / solid.voxelSize : kParallel;
      const Span span = clipped(solid.pool, origin, direction, reach);
      if (!(span.enter <= span.leave)) continue;
      ready.push_back({origin + direction * span.enter, direction, span});
      number.push_back(i);
      enter.push_back(span.enter);
    }
    block = RayBlock(ready.size());
    for (std::size_t n = 0; n < ready.size(); ++n) {
      const Ready& ray = ready[n];
      const auto set = [&](std::vector<float>& to, double value) {
        to[n] = static_cast<float>(value);
      };
      set(block.ox, ray.origin.x);
      set(block.oy, ray.origin.y);
      set(block.oz, ray.origin.z);
      set(block.dx, ray.direction.x);
      set(block.dy, ray.direction.y);
      set(block.dz, ray.direction.z);
      block.ix[n] = rayInverse(block.dx[n]);
      block.iy[n] = rayInverse(block.dy[n]);
      block.iz[n] = rayInverse(block.dz[n]);
      block.start[n] = 0;
      set(block.end, ray.span.leave - ray.span.enter);
    }
  }
};

}  // namespace

KernelScene::KernelScene(const Scene& scene, std::size_t maxBytes, Filter filter) : meshes_(scene) {
  if (scene.isBlended()) {
    fields_.emplace(scene, maxBytes);
    bounds_ = scene.bounds();
    return;
  }
  // A block for each leaf; those the surface does not cross are built and dropped.
  double leaves = 0;
  for (const Solid& solid : scene.solids)
    if (!solid.band.isEmpty())
      leaves += static_cast<double>(levelset::vdb(solid.band).tree().leafCount());
  // And a copy of the leaves where the spline's coefficients are made of the values.
  const double kCopies = filter == Filter::BSplineQi ? 4 * 512 : 0;
  const double kBytesOfBlock = 2 * 4 * (BrickPool::kValues + BrickPool::kMaskWords) + kCopies;
  levelset::requireMemory(leaves * kBytesOfBlock, maxBytes, "render");
  for (std::size_t i = 0; i < scene.solids.size(); ++i) {
    const Solid& source = scene.solids[i];
    if (!scene.csg.isEmpty() && !scene.csg.uses(i)) continue;
    KernelSolid solid;
    solid.pool = makeBricks(source.band, filter);
    if (solid.pool.brickCount() == 0) continue;
    solid.index = i;
    solid.id = source.id;
    solid.voxelSize = source.band.voxelSize();
    solids_.push_back(std::move(solid));
  }
  std::stable_sort(solids_.begin(), solids_.end(), [](const KernelSolid& a, const KernelSolid& b) {
    return std::tie(a.voxelSize, a.id) < std::tie(b.voxelSize, b.id);
  });
  std::vector<int> numbers(scene.solids.size(), -1);
  for (std::size_t s = 0; s < solids_.size(); ++s) numbers[solids_[s].index] = static_cast<int>(s);
  csg_ = scene.csg.renumbered(numbers);
  look(scene);
}

void KernelScene::look(const Scene& scene) {
  if (fields_) {
    if (fields_->place(scene)) bounds_ = scene.bounds();
    return;
  }
  bounds_ = meshes_.bounds();
  for (KernelSolid& solid : solids_) {
    const V3d corner(solid.pool.origin[0], solid.pool.origin[1], solid.pool.origin[2]);
    solid.tableToWorld =
        M44d().setTranslation(corner) * scene.solids[solid.index].band.indexToWorld();
    solid.worldToTable = solid.tableToWorld.inverse();
    solid.fan = makeRayFan(scene.camera, solid.tableToWorld, solid.voxelSize, solid.pool);
    bounds_.extendBy(Imath::transform(cellBox(solid.pool), solid.tableToWorld));
  }
}

std::size_t KernelScene::bytes() const {
  std::size_t sum = fields_ ? fields_->bytes() : 0;
  for (const KernelSolid& solid : solids_) sum += solid.pool.bytes();
  return sum;
}

std::size_t KernelScene::blocksLeftOut() const {
  std::size_t sum = 0;
  for (const KernelSolid& solid : solids_) sum += solid.pool.blocksLeftOut;
  return sum;
}

PixelHits KernelScene::castPixels(const KernelTracer& tracer, const PixelBlock& pixels) const {
  return csg_.isEmpty() ? castFirst(tracer, pixels) : castCsg(tracer, pixels);
}

PixelHits KernelScene::castFirst(const KernelTracer& tracer, const PixelBlock& pixels) const {
  PixelHits result(pixels.size());
  HitBlock hits(pixels.size());
  ShapeBlock shapes(pixels.size());
  for (std::size_t s = 0; s < solids_.size(); ++s) {
    const KernelSolid& solid = solids_[s];
    tracer.trace(solid, pixels, hits, shapes);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!hits.found[i]) continue;
      const double depth = solid.fan.depthAt(hits.t[i]);
      if (result.solid[i] >= 0 && result.depth[i] <= depth) continue;
      result.depth[i] = depth;
      result.solid[i] = static_cast<std::int32_t>(s);
      result.shapes.take(i, shapes, i);
    }
  }
  return result;
}

PixelHits KernelScene::castCsg(const KernelTracer& tracer, const PixelBlock& pixels) const {
  PixelHits result(pixels.size());
  CsgWalk walk(csg_, solids_.size(), std::vector<double>(pixels.size(), kNoEnd));
  struct Crossings {  // of one solid, the next of each ray
    std::vector<double> depth;
    ShapeBlock shapes;
  };
  std::vector<Crossings> next(solids_.size(),
                              {std::vector<double>(pixels.size()), ShapeBlock(pixels.size())});
  do {
    for (std::size_t s = 0; s < solids_.size(); ++s) {
      const KernelSolid& solid = solids_[s];
      const std::vector<CsgWalk::Question> questions = walk.questionsAbout(s);
      if (questions.empty()) continue;
      PixelBlock asked(questions.size());
      for (std::size_t n = 0; n < questions.size(); ++n) {
        asked.x[n] = pixels.x[questions[n].ray];
        asked.y[n] = pixels.y[questions[n].ray];
        asked.passing[n] = questions[n].passing;
      }
      HitBlock hits(asked.size());
      ShapeBlock shapes(asked.size());
      tracer.trace(solid, asked, hits, shapes);
      for (std::size_t n = 0; n < questions.size(); ++n) {
        if (!hits.found[n]) {
          walk.answerNone(s, questions[n]);
          continue;
        }
        const std::size_t ray = questions[n].ray;
        next[s].depth[ray] = solid.fan.depthAt(hits.t[n]);
        next[s].shapes.take(ray, shapes, n);
        walk.answer(s, questions[n], next[s].depth[ray], hits.found[n] == HitBlock::kGoesIn);
      }
    }
  } while (walk.advance());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::int32_t met = walk.solidMet(i);
    if (met < 0) continue;
    const auto s = static_cast<std::size_t>(met);
    result.solid[i] = met;
    result.depth[i] = next[s].depth[i];
    result.turned[i] = walk.isTurned(i) ? 1 : 0;
    result.shapes.take(i, next[s].shapes, i);
  }
  return result;
}

std::vector<double> KernelScene::thickness(const KernelTracer& tracer,
                                           const PixelBlock& pixels) const {
  struct Crossing {
    double depth;
    std::size_t solid;
    bool goesIn;
  };
  std::vector<std::vector<Crossing>> crossings(pixels.size());
  for (std::size_t s = 0; s < solids_.size(); ++s) {
    std::vector<std::size_t> open(pixels.size());
    std::iota(open.begin(), open.end(), std::size_t{0});
    for (std::int32_t passing = 0; !open.empty(); ++passing) {
      PixelBlock asked(open.size());
      for (std::size_t n = 0; n < open.size(); ++n) {
        asked.x[n] = pixels.x[open[n]];
        asked.y[n] = pixels.y[open[n]];
        asked.passing[n] = passing;
      }
      HitBlock hits(asked.size());
      ShapeBlock shapes(asked.size());
      tracer.trace(solids_[s], asked, hits, shapes);
      std::vector<std::size_t> rest;
      for (std::size_t n = 0; n < open.size(); ++n) {
        if (!hits.found[n]) continue;
        crossings[open[n]].push_back(
            {solids_[s].fan.depthAt(hits.t[n]), s, hits.found[n] == HitBlock::kGoesIn});
        rest.push_back(open[n]);
      }
      open = std::move(rest);
    }
  }
  std::vector<double> lengths(pixels.size(), 0);
  std::vector<char> inside(solids_.size()), known(solids_.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    std::vector<Crossing>& all = crossings[i];
    std::stable_sort(all.begin(), all.end(),
                     [](const Crossing& a, const Crossing& b) { return a.depth < b.depth; });
    std::fill(inside.begin(), inside.end(), 0);
    std::fill(known.begin(), known.end(), 0);
    for (const Crossing& crossing : all)  // the first of each solid tells where the ray starts
      if (!std::exchange(known[crossing.solid], 1))
        inside[crossing.solid] = crossing.goesIn ? 0 : 1;
    double from = 0;
    for (const Crossing& crossing : all) {
      if (isInside(inside)) lengths[i] += std::max(0.0, crossing.depth - from);
      from = std::max(0.0, crossing.depth);
      inside[crossing.solid] = crossing.goesIn ? 1 : 0;
    }
  }
  return lengths;
}

bool KernelScene::isInside(const std::vector<char>& inside) const {
  if (!csg_.isEmpty()) return csg_.holds(inside.data());
  return std::any_of(inside.begin(), inside.end(), [](char in) { return in != 0; });
}

std::vector<char> KernelScene::findBlocked(const KernelTracer& tracer,
                                           const std::vector<LightRay>& rays) const {
  std::vector<char> blocked(rays.size(), 0);
  for (std::size_t i = 0; i < rays.size() && fields_; ++i)
    blocked[i] = fields_->isOccluded(rays[i].origin, rays[i].direction, rays[i].reach) ? 1 : 0;
  for (std::size_t first = 0; first < rays.size() && !fields_; first += kRaysAtOnce) {
    const std::size_t last = std::min(rays.size(), first + kRaysAtOnce);
    if (csg_.isEmpty())
      blockFirst(tracer, rays, first, last, blocked);
    else
      blockCsg(tracer, rays, first, last, blocked);
  }
  for (std::size_t i = 0; i < rays.size() && !meshes_.isEmpty(); ++i)
    if (!blocked[i] && meshes_.isOccluded(rays[i].origin, rays[i].direction, rays[i].reach))
      blocked[i] = 1;
  return blocked;
}

void KernelScene::blockFirst(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                             std::size_t first, std::size_t last,
                             std::vector<char>& blocked) const {
  for (const KernelSolid& solid : solids_) {
    std::vector<std::size_t> open;
    for (std::size_t i = first; i < last; ++i)
      if (!blocked[i]) open.push_back(i);
    const PackedRays packed(solid, rays, open, true);
    HitBlock hits(packed.block.size);
    tracer.trace(solid, packed.block, hits);
    for (std::size_t n = 0; n < packed.number.size(); ++n)
      if (hits.found[n]) blocked[packed.number[n]] = 1;
  }
}

void KernelScene::blockCsg(const KernelTracer& tracer, const std::vector<LightRay>& rays,
                           std::size_t first, std::size_t last, std::vector<char>& blocked) const {
  std::vector<double> reach;
  for (std::size_t i = first; i < last; ++i) reach.push_back(rays[i].reach);
  CsgWalk walk(csg_, solids_.size(), std::move(reach));
  do {
    for (std::size_t s = 0; s < solids_.size(); ++s) {
      const KernelSolid& solid = solids_[s];
      const std::vector<CsgWalk::Question> questions = walk.questionsAbout(s);
      std::vector<std::size_t> asked;
      for (const CsgWalk::Question& question : questions) asked.push_back(first + question.ray);
      // To their end: where a ray ends inside a solid only what comes later tells that it is.
      PackedRays packed(solid, rays, asked, false);
      std::size_t n = 0;
      for (const CsgWalk::Question& question : questions) {
        if (n < packed.number.size() && packed.number[n] == first + question.ray)
          packed.block.passing[n++] = question.passing;
      }
      HitBlock hits(packed.block.size);
      if (!packed.number.empty()) tracer.trace(solid, packed.block, hits);
      n = 0;
      for (const CsgWalk::Question& question : questions) {
        const bool isNear = n < packed.number.size() && packed.number[n] == first + question.ray;
        if (isNear && hits.found[n])
          walk.answer(s, question,
                      (packed.enter[n] + static_cast<double>(hits.t[n])) * solid.voxelSize,
                      hits.found[n] == HitBlock::kGoesIn);
        else
          walk.answerNone(s, question);
        if (isNear) ++n;
      }
    }
  } while (walk.advance());
  for (std::size_t i = first; i < last; ++i)
    if (walk.solidMet(i - first) >= 0) blocked[i] = 1;
}

}  // namespace render
