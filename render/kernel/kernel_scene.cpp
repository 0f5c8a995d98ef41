#include "render/kernel/kernel_scene.h"

#include <Imath/ImathBoxAlgo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "levelset/vdb.h"
#include "render/kernel/frustum_culling.h"
#include "render/kernel/hit_refinement.h"

namespace render {
namespace {

using Imath::M44d;
using Imath::V3d;

/// A world-space box that contains all cells that the band's surface may cross.
Imath::Box3d leafBox(const levelset::NarrowBand& band) {
  openvdb::CoordBBox leaves;
  if (band.isEmpty() || !levelset::vdb(band).tree().evalLeafBoundingBox(leaves)) return {};
  leaves.expand(BrickPool::kBlock);
  return Imath::transform(Imath::Box3d(levelset::toImath(leaves.min().asVec3d()),
                                       levelset::toImath(leaves.max().asVec3d())),
                          band.indexToWorld());
}

/// Upper bound on the length of a vector's image by the linear part of a map, for unit vectors.
double largestGrowth(const M44d& map) {
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum += map[i][j] * map[i][j];
  return std::sqrt(sum);
}

/// Depth of hit n of the rays through pixels after its refinement, world units.
double refinedDepth(const KernelSolid& solid, const PixelBlock& pixels, std::size_t n,
                    const HitBlock& hits, ShapeBlock& shapes) {
  const auto ray =
      solid.fan.exactRay(static_cast<double>(pixels.x[n]), static_cast<double>(pixels.y[n]));
  return solid.fan.depthAt(refineHit(solid, ray, n, hits, shapes));
}

}  // namespace

std::vector<VolumeLight> KernelTracer::volumeLight(const DirectVolume& volume,
                                                   const std::vector<VolumeSegment>& segments,
                                                   const VolumeShading* shading) const {
  std::vector<VolumeLight> light;
  light.reserve(segments.size());
  for (const auto& [origin, direction, near, far] : segments)
    light.push_back(volume.light(origin, direction, near, far, shading));
  return light;
}

SharedTree::Roots KernelTracer::bezierRoots(const SharedTree& tree,
                                            const std::vector<Camera::Ray>& rays,
                                            TreeCounts* counts) const {
  return tree.rootsOf(rays, counts);
}

std::vector<QuadricHit> KernelTracer::quadricHits(const QuadricCaster& caster,
                                                  const std::vector<Camera::Ray>& rays) const {
  return caster.firstHits(rays);
}

std::vector<TerrainHit> KernelTracer::terrainHits(const TerrainCaster& caster,
                                                  const std::vector<Camera::Ray>& rays) const {
  return caster.firstHits(rays);
}

std::vector<InterfaceHit> KernelTracer::interfaceHits(const InterfaceCaster& caster,
                                                      const std::vector<InterfaceRay>& rays,
                                                      bool wantsNormals) const {
  std::vector<InterfaceHit> hits(rays.size());
  for (std::size_t n = 0; n < rays.size(); ++n)
    if (wantsNormals)
      hits[n] = caster.firstHit(rays[n]);
    else
      hits[n].found = caster.isOccluded(rays[n]);
  return hits;
}

KernelScene::KernelScene(const Scene& scene, std::size_t maxBytes, Filter filter)
    : meshes_(scene),
      mapped_(scene),
      segmented_(scene.segmented),
      beziers_(scene.beziers),
      quadrics_(scene.quadrics),
      terrains_(scene.terrains) {
  makeTables(scene, {.filter = filter, .maxBytes = maxBytes}, false);
}

KernelScene::KernelScene(const Scene& scene, const RenderOptions& options)
    : meshes_(scene),
      mapped_(scene),
      segmented_(scene.segmented),
      beziers_(scene.beziers),
      quadrics_(scene.quadrics),
      terrains_(scene.terrains) {
  makeTables(scene, options, true);
}

void KernelScene::makeTables(const Scene& scene, const RenderOptions& options, bool isPicture) {
  if (scene.isBlended()) {
    fields_.emplace(scene, options.maxBytes);
    bounds_ = tableBounds_ = scene.bounds();
    return;
  }
  // The memory estimate counts one block for each leaf, because the number of blocks that the
  // surface crosses is not known yet.
  double leaves = 0;
  Imath::Box3d box = meshes_.bounds();
  box.extendBy(mapped_.bounds());
  if (segmented_) box.extendBy(segmented_->caster.bounds());
  for (const Solid& solid : scene.solids) {
    if (solid.isEmpty(options.filter)) continue;
    if (solid.volume) {
      leaves += static_cast<double>(solid.volume->blocks(options.filter).size());
      box.extendBy(solid.volume->volume().grid().bounds());
      continue;
    }
    leaves += static_cast<double>(levelset::vdb(solid.band).tree().leafCount());
    box.extendBy(leafBox(solid.band));
  }
  // For BSplineQi the leaves are copied, to store the spline's coefficients.
  const double kCopies = options.filter == Filter::BSplineQi ? 4 * 512 : 0;
  const double kBytesOfBlock =
      2 * 4 * (std::max(BrickPool::kCubeValues, 4 * BrickPool::kSites) + BrickPool::kMaskWords) +
      kCopies;
  levelset::requireMemory(leaves * kBytesOfBlock, options.maxBytes);
  // Culling knows how far light rays start from solids and meshes, but not from mapped textures,
  // Bézier volumes, quadrics and terrains. Mirrors show what is outside the frame.
  const bool isKnown = !box.isEmpty() && mapped_.isEmpty() && beziers_.empty() &&
                       quadrics_.empty() && terrains_.empty() && !options.optics.isActive();
  const FrustumCulling culling =
      isPicture && isKnown ? FrustumCulling(scene, options, box) : FrustumCulling();
  for (std::size_t i = 0; i < scene.solids.size(); ++i) {
    const Solid& source = scene.solids[i];
    if (source.isEmpty(options.filter) || (!scene.csg.isEmpty() && !scene.csg.uses(i))) continue;
    const M44d toWorld = source.indexToWorld();
    const double growth = source.volume ? largestGrowth(toWorld) : source.voxelSize();
    KernelSolid solid;
    TableOptions tables{.filter = options.filter, .quantization = source.quantization};
    if (isPicture)
      tables.keeps = [&](const V3d& centre, double radius) {
        return culling.keeps(centre * toWorld, radius * growth);
      };
    solid.pool =
        source.volume ? makeBricks(*source.volume, tables) : makeBricks(source.band, tables);
    const BrickPool& pool = solid.pool;
    counts_.omitted += pool.blocksOmitted;
    counts_.culled += pool.blocksCulled;
    if (pool.brickCount() + pool.blocksCulled == 0) continue;
    Extent& extent = extents_.emplace_back();
    extent.index = i;
    const V3d origin = V3d(pool.origin[0], pool.origin[1], pool.origin[2]) - V3d(pool.shift());
    const auto boxOf = [&](const std::array<int, 3>& low, const std::array<int, 3>& high) {
      return Imath::Box3d(origin + V3d(low[0], low[1], low[2]),
                          origin + V3d(high[0], high[1], high[2]));
    };
    extent.blocks = boxOf(pool.low, pool.high);
    extent.cells = boxOf(pool.cellsLow, pool.cellsHigh);
    if (pool.brickCount() == 0) continue;
    counts_.crossed += pool.brickCount();
    counts_.halo += pool.haloCount;
    solid.index = i;
    solid.id = source.id;
    solid.voxelSize = source.voxelSize();
    solid.isVolume = source.volume != nullptr;
    solids_.push_back(std::move(solid));
  }
  std::stable_sort(solids_.begin(), solids_.end(), [](const KernelSolid& a, const KernelSolid& b) {
    return std::tie(a.voxelSize, a.id) < std::tie(b.voxelSize, b.id);
  });
  std::vector<int> numbers(scene.solids.size() + beziers_.size(), -1);
  for (std::size_t s = 0; s < solids_.size(); ++s) numbers[solids_[s].index] = static_cast<int>(s);
  for (std::size_t part = 0; part < beziers_.size(); ++part) {
    if (!scene.isOperand(part)) continue;
    numbers[scene.solids.size() + part] = static_cast<int>(operandCount());
    operands_.push_back(part);
  }
  csg_ = scene.csg.renumbered(numbers);
  updateView(scene);
}

void KernelScene::updateView(const Scene& scene) {
  if (fields_) {
    if (fields_->updateTransforms(scene)) bounds_ = tableBounds_ = scene.bounds();
    return;
  }
  camera_ = scene.camera;
  near_ = scene.camera.near;
  far_ = scene.camera.farthest();
  bounds_ = meshes_.bounds();
  bounds_.extendBy(mapped_.bounds());
  if (segmented_) bounds_.extendBy(segmented_->caster.bounds());
  for (const BezierPart& part : beziers_) bounds_.extendBy(part.caster.bounds());
  for (const QuadricPart& part : quadrics_) bounds_.extendBy(part.caster.bounds());
  for (const TerrainPart& part : terrains_) bounds_.extendBy(part.caster.bounds());
  trees_.clear();
  // An operand is crossed beyond the end of the view, too: its last crossing shows if the ray is
  // inside it.
  Camera endless = scene.camera;
  endless.far.reset();
  for (std::size_t n = 0; n < beziers_.size(); ++n)
    trees_.push_back(std::make_shared<const SharedTree>(
        beziers_[n].caster.volume(), isOperand(n) ? endless : scene.camera,
        TreeOptions{.allRoots = isOperand(n) || beziers_[n].opacity < 1}));
  bezierSolid_ = scene.solids.size() + scene.mapped.size() + (segmented_ ? 1 : 0);
  tableBounds_ = bounds_;
  for (const Extent& extent : extents_) {
    const M44d toWorld = scene.solids[extent.index].indexToWorld();
    bounds_.extendBy(Imath::transform(extent.cells, toWorld));
    tableBounds_.extendBy(Imath::transform(extent.blocks, toWorld));
  }
  if (bounds_.isEmpty()) bounds_ = tableBounds_ = scene.volumeBounds();
  for (KernelSolid& solid : solids_) {
    solid.opacity = scene.solids[solid.index].opacity;
    const V3d corner = V3d(solid.pool.origin[0], solid.pool.origin[1], solid.pool.origin[2]) -
                       V3d(solid.pool.shift());
    solid.tableToWorld = M44d().setTranslation(corner) * scene.solids[solid.index].indexToWorld();
    solid.worldToTable = solid.tableToWorld.inverse();
    solid.fan = makeRayFan(scene.camera, solid.tableToWorld, solid.voxelSize, solid.pool);
  }
}

std::size_t KernelScene::bytes() const {
  std::size_t sum = fields_ ? fields_->bytes() : 0;
  for (const KernelSolid& solid : solids_) sum += solid.pool.bytes();
  if (segmented_) sum += segmented_->caster.field().memoryUse() + segmented_->caster.bytes();
  for (const BezierPart& part : beziers_) sum += part.caster.bytes();
  for (const QuadricPart& part : quadrics_) sum += part.caster.bytes();
  for (const TerrainPart& part : terrains_) sum += part.caster.bytes();
  for (const auto& tree : trees_) sum += tree->counts().peakBytes;
  return sum + mapped_.bytes();
}

BezierHits KernelScene::castBeziers(const KernelTracer& tracer,
                                    const std::vector<Camera::Ray>& rays,
                                    TreeCounts* counts) const {
  BezierHits result;
  if (operands_.size() == beziers_.size()) return result;
  std::vector<SharedTree::Roots> found(beziers_.size());
  for (std::size_t part = 0; part < beziers_.size(); ++part) {
    if (isOperand(part))
      found[part].first.assign(rays.size() + 1, 0);
    else
      found[part] = tracer.bezierRoots(*trees_[part], rays, counts);
  }
  result.first.push_back(0);
  std::vector<std::pair<const BezierRoot*, std::size_t>> roots;  // of a ray, with their parts
  for (std::size_t i = 0; i < rays.size(); ++i) {
    roots.clear();
    for (std::size_t part = 0; part < found.size(); ++part)
      for (std::size_t n = found[part].first[i]; n < found[part].first[i + 1]; ++n)
        roots.emplace_back(&found[part].roots[n], part);
    std::stable_sort(roots.begin(), roots.end(), [](const auto& a, const auto& b) {
      return a.first->distance < b.first->distance;
    });
    for (const auto& [root, part] : roots) {
      result.hits.push_back(
          beziers_[part].hitOf(rays[i], root->distance, root->normal, bezierSolid_ + part));
      result.hits.back().isSingular = root->isSingular;
      if (beziers_[part].opacity == 1) break;
    }
    result.first.push_back(result.hits.size());
  }
  return result;
}

std::vector<Hit> KernelScene::castQuadrics(const KernelTracer& tracer,
                                           const std::vector<Camera::Ray>& rays) const {
  std::vector<Hit> hits(quadrics_.empty() ? 0 : rays.size());
  for (std::size_t part = 0; part < quadrics_.size(); ++part) {
    const QuadricCaster& caster = quadrics_[part].caster;
    const std::vector<QuadricHit> found = tracer.quadricHits(caster, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!found[i].found || (hits[i].found && hits[i].distance <= found[i].distance)) continue;
      hits[i] =
          quadrics_[part].hitOf(rays[i], found[i].distance, found[i].normal,
                                caster.colourOf(found[i]), bezierSolid_ + beziers_.size() + part);
      hits[i].primitive = found[i].slot;
    }
  }
  return hits;
}

std::vector<Hit> KernelScene::castTerrains(const KernelTracer& tracer,
                                           const std::vector<Camera::Ray>& rays) const {
  std::vector<Hit> hits(terrains_.empty() ? 0 : rays.size());
  const std::size_t first = bezierSolid_ + beziers_.size() + quadrics_.size();
  for (std::size_t part = 0; part < terrains_.size(); ++part) {
    const std::vector<TerrainHit> found = tracer.terrainHits(terrains_[part].caster, rays);
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (found[i].found && (!hits[i].found || found[i].distance < hits[i].distance))
        hits[i] = terrains_[part].hitOf(rays[i], found[i], first + part);
  }
  return hits;
}

PixelHits KernelScene::castPixels(const KernelTracer& tracer, const PixelBlock& pixels,
                                  OperandCrossings* operands) const {
  if (csg_.isEmpty()) return castFirst(tracer, pixels);
  PixelTraversal walk = startTraversal(tracer, pixels);
  PixelHits hits = castNext(tracer, walk);
  if (operands) *operands = std::move(walk.beziers);
  return hits;
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
      const double depth = refinedDepth(solid, pixels, i, hits, shapes);
      if (depth > far_) continue;
      if (result.solid[i] >= 0 && result.depth[i] <= depth) continue;
      result.depth[i] = depth;
      result.solid[i] = static_cast<std::int32_t>(s);
      result.shapes.take(i, shapes, i);
    }
  }
  return result;
}

PixelTraversal KernelScene::startTraversal(const KernelTracer& tracer,
                                           const PixelBlock& pixels) const {
  const std::size_t count = pixels.size();
  PixelTraversal walk{pixels, CsgTraversal(csg_, operandCount(), std::vector<double>(count, far_)),
                      emptyCrossings(count)};
  if (operands_.empty()) return walk;
  const CameraRays at(camera_);
  std::vector<Camera::Ray> rays;
  for (std::size_t i = 0; i < count; ++i)
    rays.push_back(at.at(static_cast<double>(pixels.x[i]) + camera_.middleX(),
                         static_cast<double>(pixels.y[i]) + 0.5 * camera_.height));
  walk.beziers = crossOperands(tracer, rays);
  return walk;
}

std::vector<PixelTraversal::Crossings> KernelScene::emptyCrossings(std::size_t rays) const {
  std::vector<PixelTraversal::Crossings> next(solids_.size(),
                                              {std::vector<double>(rays), ShapeBlock(rays)});
  if (!operands_.empty())
    next.resize(operandCount(),
                {std::vector<double>(rays), ShapeBlock(0), std::vector<BezierRoot>(rays)});
  return next;
}

void PixelTraversal::takeMet(const CsgTraversal& walk, const std::vector<Crossings>& next,
                             PixelHits& hits) {
  for (std::size_t i = 0; i < hits.solid.size(); ++i) {
    const std::int32_t met = walk.solidMet(i);
    if (met < 0) continue;
    const auto s = static_cast<std::size_t>(met);
    hits.solid[i] = met;
    hits.depth[i] = next[s].depth[i];
    hits.flipped[i] = walk.isFlipped(i) ? 1 : 0;
    if (next[s].roots.empty()) {
      hits.shapes.take(i, next[s].shapes, i);
      continue;
    }
    hits.roots.resize(hits.solid.size());
    hits.roots[i] = next[s].roots[i];
  }
}

PixelHits KernelScene::castNext(const KernelTracer& tracer, PixelTraversal& traversal) const {
  auto& [pixels, walk, next, beziers] = traversal;
  PixelHits result(pixels.size());
  do {
    for (std::size_t s = 0; s < solids_.size(); ++s) {
      const KernelSolid& solid = solids_[s];
      const std::vector<CsgTraversal::Query> queries = walk.queriesFor(s);
      if (queries.empty()) continue;
      PixelBlock asked(queries.size());
      for (std::size_t n = 0; n < queries.size(); ++n) {
        asked.x[n] = pixels.x[queries[n].ray];
        asked.y[n] = pixels.y[queries[n].ray];
        asked.passing[n] = queries[n].passing;
      }
      HitBlock hits(asked.size());
      ShapeBlock shapes(asked.size());
      tracer.trace(solid, asked, hits, shapes);
      for (std::size_t n = 0; n < queries.size(); ++n) {
        if (!hits.found[n]) {
          walk.answerNone(s, queries[n]);
          continue;
        }
        const std::size_t ray = queries[n].ray;
        next[s].depth[ray] = refinedDepth(solid, asked, n, hits, shapes);
        next[s].shapes.take(ray, shapes, n);
        // The order of the crossings is that of the kernel's parameters.
        walk.answer(s, queries[n], solid.fan.depthAt(static_cast<double>(hits.t[n])),
                    hits.found[n] == HitBlock::kEnters);
      }
    }
    for (std::size_t n = 0; n < operands_.size(); ++n)
      answerOperand(walk, solids_.size() + n, beziers.roots[n], &next[solids_.size() + n],
                    [](const BezierRoot& root) { return root.depth; });
  } while (walk.advance());
  PixelTraversal::takeMet(walk, next, result);
  return result;
}

std::vector<double> KernelScene::thickness(const KernelTracer& tracer,
                                           const PixelBlock& pixels) const {
  struct Crossing {
    double depth;
    std::size_t solid;
    bool enters;
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
        crossings[open[n]].push_back({solids_[s].fan.depthAt(static_cast<double>(hits.t[n])), s,
                                      hits.found[n] == HitBlock::kEnters});
        rest.push_back(open[n]);
      }
      open = std::move(rest);
    }
  }
  std::vector<double> lengths(pixels.size(), 0);
  // Bézier volumes of the expression count as absent; requirePicture() refuses them.
  std::vector<char> inside(solids_.size() + beziers_.size(), 0), known(solids_.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    std::vector<Crossing>& all = crossings[i];
    std::stable_sort(all.begin(), all.end(),
                     [](const Crossing& a, const Crossing& b) { return a.depth < b.depth; });
    std::fill(inside.begin(), inside.end(), 0);
    std::fill(known.begin(), known.end(), 0);
    // The first crossing with each solid shows if the ray starts inside the solid.
    for (const Crossing& crossing : all)
      if (!std::exchange(known[crossing.solid], 1))
        inside[crossing.solid] = crossing.enters ? 0 : 1;
    double from = near_;
    for (const Crossing& crossing : all) {
      const double to = std::clamp(crossing.depth, near_, far_);
      if (isInside(inside)) lengths[i] += std::max(0.0, to - from);
      from = to;
      inside[crossing.solid] = crossing.enters ? 1 : 0;
    }
  }
  return lengths;
}

bool KernelScene::isInside(const std::vector<char>& inside) const {
  if (!csg_.isEmpty()) return csg_.holds(inside.data());
  return std::any_of(inside.begin(), inside.end(), [](char in) { return in != 0; });
}

}  // namespace render
