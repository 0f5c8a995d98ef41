#include "render/kernel/paint.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "render/shading/principal_direction.h"
#include "render/shading/surface_shape.h"

namespace render {
namespace {

using Imath::C3f;
using Imath::V2d;
using Imath::V3d;

constexpr int kSquare = 4;  // edge of the squares that order the pixels for tracing, pixels
// Number of collected light rays above which they are traced.
constexpr std::size_t kMostLightRays = 1u << 18;
// Bound on the rounding error of the kernel's hit depths, voxels. It is added to the surface error,
// so that light rays start farther from the surface.
constexpr double kCastError = 2e-3;
// A lattice point has the light rays of this many colour samples, unless the pixels have fewer.
constexpr int kLatticeSamples = 4;
// Light is not interpolated if a lattice point has fewer rays to the sky and to the key light than
// this.
constexpr int kFewestRays = 16;
// Shadow rays from the centre of a pixel that look for shadows between lattice points.
constexpr int kProbes = 2;
// Lattice points in a penumbra have so many times the shadow rays of others.
constexpr int kPenumbraSamples = 6;

std::vector<FieldRay> fieldRays(const std::vector<Camera::Ray>& rays) {
  std::vector<FieldRay> result;
  result.reserve(rays.size());
  for (const Camera::Ray& ray : rays)
    result.push_back({ray.origin, ray.direction, ray.near, ray.far});
  return result;
}

}  // namespace

KernelPainter::KernelPainter(const Scene& scene, const KernelScene& surfaces,
                             const RenderOptions& options, Image& image)
    : scene_(scene),
      surfaces_(surfaces),
      options_(options),
      camera_(scene.camera),
      shader_(scene, surfaces.bounds().size().length(), options),
      layers_(image, scene, options) {
  if (options.optics.isActive())
    paths_.emplace(shader_, surfaces.bounds().size().length(), options.optics, options.maxBytes);
}

void KernelPainter::paint(const KernelTracer& tracer, const PixelBox& box) const {
  const std::vector<Pixel> pixels = pixelsOf(box);
  const LightLattice lattice = latticeOf(tracer, box);
  const bool isColoursOnly =
      !options_.layers && !options_.lightLayers && !usesLights(options_.style.style);
  const std::vector<char> contradicts =
      isColoursOnly ? std::vector<char>(pixels.size(), 0) : paintData(tracer, pixels, lattice);
  paintColours(tracer, pixels, lattice, contradicts);
}

LightLattice KernelPainter::latticeOf(const KernelTracer& tracer, const PixelBox& box) const {
  if (options_.lightSpacing <= 1 || !scene_.isOpaque() || !usesLights(options_.style.style))
    return {};
  // With few rays the corners of a cell agree by chance.
  const int samples = std::min(options_.samples, kLatticeSamples);
  if (samples * std::max(options_.ambientSamples, options_.shadowSamples) < kFewestRays) return {};
  const Camera& camera = scene_.camera;
  LightLattice lattice(box, camera.width, camera.height, options_.lightSpacing);
  const std::vector<LightLattice::Point>& points = lattice.points();
  PixelBlock at(points.size());
  std::vector<Camera::Ray> views;
  for (std::size_t i = 0; i < points.size(); ++i) {
    at.x[i] = static_cast<float>(points[i].x - camera.middleX());
    at.y[i] = static_cast<float>(points[i].y - 0.5 * camera.height);
    views.push_back(camera_.at(points[i].x, points[i].y));
  }
  const PixelHits hits = castPixels(tracer, at);
  const FirstHits first = firstHits(tracer, views);
  std::vector<LightLattice::Node> nodes(points.size());
  std::vector<LightRay> rays;
  std::vector<LightRays> ranges(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    nodes[i].hit = hitOf(views[i], views[i].near, hits, first, i);
    if (!nodes[i].hit.found) nodes[i].hit = shader_.groundHit(views[i]);
    if (!nodes[i].hit.found) continue;
    const auto x = static_cast<int>(points[i].x), y = static_cast<int>(points[i].y);
    // All rays to the sky come first, as LightRays requires.
    LightRays& range = ranges[i];
    range.first = rays.size();
    for (int s = 0; s < samples; ++s)
      range.sky +=
          shader_.addRays(nodes[i].hit, views[i].direction, x, y, s, rays, LightKind::Sky).sky;
    const LightRays key = shader_.addShadowRays(nodes[i].hit, views[i].direction, x, y,
                                                samples * options_.shadowSamples, rays);
    range.key = key.key;
    range.behind = key.behind;
  }
  const std::vector<double> light = surfaces_.transmittances(tracer, rays);
  std::vector<std::size_t> inPenumbra;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!nodes[i].hit.found) continue;
    nodes[i].light = Shader::lightOf(ranges[i], rays, light);
    if (LightLattice::isPenumbra(nodes[i].light)) inPenumbra.push_back(i);
  }
  // Shadow rays are noisy where the light is partly hidden. Trace more of them there.
  std::vector<LightRay> shadowRays;
  std::vector<LightRays> shadowRanges;
  for (const std::size_t i : inPenumbra) {
    const auto x = static_cast<int>(points[i].x), y = static_cast<int>(points[i].y);
    shadowRanges.push_back(
        shader_.addShadowRays(nodes[i].hit, views[i].direction, x, y,
                              kPenumbraSamples * samples * options_.shadowSamples, shadowRays));
  }
  const std::vector<double> shadows = surfaces_.transmittances(tracer, shadowRays);
  for (std::size_t n = 0; n < inPenumbra.size(); ++n)
    nodes[inPenumbra[n]].light.key = Shader::lightOf(shadowRanges[n], shadowRays, shadows).key;
  lattice.setNodes(std::move(nodes));
  return lattice;
}

std::vector<KernelPainter::Pixel> KernelPainter::pixelsOf(const PixelBox& box) {
  std::vector<Pixel> pixels;
  for (int top = box.top; top < box.bottom; top += kSquare)
    for (int left = box.left; left < box.right; left += kSquare)
      for (int y = top; y < std::min(top + kSquare, box.bottom); ++y)
        for (int x = left; x < std::min(left + kSquare, box.right); ++x) pixels.push_back({x, y});
  return pixels;
}

std::size_t KernelPainter::numberOf(const Pixel& pixel) const {
  return static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(scene_.camera.width) +
         static_cast<std::size_t>(pixel.x);
}

void KernelPainter::countOperands(const OperandCrossings& operands) const {
  if (operands.overruns > 0) layers_.overruns += operands.overruns;
  if (operands.open > 0) layers_.open += operands.open;
}

PixelHits KernelPainter::castPixels(const KernelTracer& tracer, const PixelBlock& pixels) const {
  OperandCrossings operands;
  PixelHits hits = surfaces_.castPixels(tracer, pixels, &operands);
  countOperands(operands);
  return hits;
}

KernelPainter::FirstHits KernelPainter::firstHits(const KernelTracer& tracer,
                                                  const std::vector<Camera::Ray>& rays,
                                                  bool ofCamera) const {
  FirstHits first;
  if (surfaces_.fields()) first.onFields = surfaces_.fields()->intersect(tracer, fieldRays(rays));
  if (const SegmentedPart* segmented = surfaces_.segmented()) {
    std::vector<InterfaceRay> asked;
    asked.reserve(rays.size());
    for (const Camera::Ray& ray : rays)
      asked.push_back({ray.origin, ray.direction, ray.near, ray.far});
    const std::vector<InterfaceHit> hits = tracer.interfaceHits(segmented->caster, asked, true);
    first.onInterfaces.reserve(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i)
      first.onInterfaces.push_back(
          segmented->hitOf(asked[i], hits[i], scene_.solids.size() + scene_.mapped.size()));
  }
  TreeCounts counts;
  first.onBeziers =
      ofCamera ? surfaces_.castBeziers(tracer, rays, &counts) : surfaces_.castBeziersOf(rays);
  if (counts.overruns > 0) layers_.overruns += counts.overruns;
  first.onQuadrics = surfaces_.castQuadrics(tracer, rays);
  first.onTerrains = surfaces_.castTerrains(tracer, rays);
  return first;
}

Hit KernelPainter::hitOf(const Camera::Ray& ray, double meshNear, const PixelHits& hits,
                         const FirstHits& first, std::size_t i, std::size_t passed) const {
  Hit onSolid;
  if (!first.onFields.empty())
    onSolid = first.onFields[i];
  else if (hits.solid[i] >= 0)
    onSolid = hitOnSolid(ray, hits.depth[i] / ray.direction.dot(camera_.axis()), hits, i);
  return nearestOf(ray, meshNear, onSolid, first, i, passed);
}

Hit KernelPainter::nearestOf(const Camera::Ray& ray, double meshNear, const Hit& onSolid,
                             const FirstHits& first, std::size_t i, std::size_t passed) const {
  Hit nearest = onSolid;
  const auto farthest = [&] { return nearest.found ? nearest.distance : ray.far; };
  if (!surfaces_.meshes().isEmpty()) {
    const Hit onMesh =
        surfaces_.meshes().intersect(ray.origin, ray.direction, meshNear, farthest());
    if (onMesh.found) nearest = onMesh;
  }
  if (!surfaces_.mapped().isEmpty()) {
    const Hit onTexture =
        surfaces_.mapped().intersect(ray.origin, ray.direction, ray.near, farthest());
    if (onTexture.found) nearest = onTexture;
  }
  for (const std::vector<Hit>* others :
       {&first.onInterfaces, &first.onQuadrics, &first.onTerrains}) {
    if (others->empty()) continue;
    const Hit& other = (*others)[i];
    if (other.found && (!nearest.found || other.distance < nearest.distance)) nearest = other;
  }
  if (const BezierHits& on = first.onBeziers; !on.hits.empty()) {
    const std::size_t next = on.first[i] + passed;
    if (next < on.first[i + 1] && (!nearest.found || on.hits[next].distance < nearest.distance))
      nearest = on.hits[next];
  }
  return nearest;
}

Hit KernelPainter::hitOnSolid(const Camera::Ray& ray, double distance, const PixelHits& hits,
                              std::size_t i) const {
  const auto number = static_cast<std::size_t>(hits.solid[i]);
  if (number >= surfaces_.solids().size()) return surfaces_.hitOnOperand(ray, hits, i);
  const KernelSolid& solid = surfaces_.solids()[number];
  Hit hit;
  hit.found = true;
  hit.distance = distance;
  hit.position = ray.origin + ray.direction * hit.distance;
  hit.id = solid.id;
  hit.solid = solid.index;
  hit.colour = scene_.solids[solid.index].colour;
  hit.opacity = solid.opacity;
  hit.isFlipped = hits.flipped[i] != 0;
  if (solid.isVolume)
    addVolumeShape(hit, hits.shapes.at(i), solid.worldToTable, solid.voxelSize, ray.direction);
  else
    addShape(hit, hits.shapes.at(i), solid.tableToWorld, ray.direction);
  if (options_.hasDirections() || showsDirections(options_.style.style)) {
    if (solid.isVolume)
      addVolumeDirection(hit, hits.shapes.at(i), solid.worldToTable);
    else
      addDirection(hit, hits.shapes.at(i), solid.tableToWorld);
  }
  hit.surfaceError += kCastError * solid.voxelSize;
  return hit;
}

class KernelPainter::AnyRays : public SceneRays {
 public:
  AnyRays(const KernelPainter& painter, const KernelTracer& tracer)
      : painter_(painter), tracer_(tracer) {}
  [[nodiscard]] std::vector<Hit> firstHits(const std::vector<Camera::Ray>& rays) const override {
    return painter_.castRays(tracer_, rays);
  }
  [[nodiscard]] std::vector<double> transmittances(
      const std::vector<LightRay>& rays) const override {
    return painter_.surfaces_.transmittances(tracer_, rays);
  }

 private:
  const KernelPainter& painter_;
  const KernelTracer& tracer_;
};

std::vector<Hit> KernelPainter::castRays(const KernelTracer& tracer,
                                         const std::vector<Camera::Ray>& rays) const {
  const FirstHits first = firstHits(tracer, rays, false);
  const PixelHits onSolids = surfaces_.castRays(tracer, rays);
  std::vector<Hit> hits;
  hits.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Hit onSolid;
    if (!first.onFields.empty())
      onSolid = first.onFields[i];
    else if (onSolids.solid[i] >= 0)
      onSolid = hitOnSolid(rays[i], onSolids.depth[i], onSolids, i);
    hits.push_back(nearestOf(rays[i], rays[i].near, onSolid, first, i, 0));
  }
  return hits;
}

std::vector<char> KernelPainter::paintData(const KernelTracer& tracer,
                                           const std::vector<Pixel>& pixels,
                                           const LightLattice& lattice) const {
  const double middleX = scene_.camera.middleX(), middleY = 0.5 * scene_.camera.height;
  PixelBlock at(pixels.size());
  std::vector<Camera::Ray> views;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    at.x[i] = static_cast<float>(pixels[i].x + 0.5 - middleX);
    at.y[i] = static_cast<float>(pixels[i].y + 0.5 - middleY);
    views.push_back(camera_.at(pixels[i].x + 0.5, pixels[i].y + 0.5));
  }
  if (options_.thickness) {
    const FieldTraversal* fields = surfaces_.fields();
    const std::vector<double> lengths =
        fields ? fields->thickness(tracer, fieldRays(views)) : surfaces_.thickness(tracer, at);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      layers_.thickness[numberOf(pixels[i])] = static_cast<float>(
          fields ? lengths[i] : lengths[i] / views[i].direction.dot(camera_.axis()));
  }
  // Shadow rays from the centres (probes) find shadows that are thinner than the spacing of the
  // lattice.
  struct Probe {
    std::size_t pixel;
    double expected;
    LightRays range;
  };
  std::vector<Probe> probes;
  std::vector<LightRay> shadowRays;
  const PixelHits hits = castPixels(tracer, at);
  const FirstHits first = firstHits(tracer, views);
  std::vector<VolumeSegment> inVolume;  // from the camera to the first surfaces
  std::vector<Hit> seen;                // for the layers of light
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto& [x, y] = pixels[i];
    const std::size_t number = numberOf(pixels[i]);
    const Camera::Ray& ray = views[i];
    Hit hit = hitOf(ray, ray.near, hits, first, i);
    if (layers_.volume[0])
      inVolume.push_back({ray.origin, ray.direction, ray.near, hit.found ? hit.distance : ray.far});
    if (layers_.light[0]) seen.push_back(hit);
    if (hit.found) {
      layers_.setHit(number, scene_.camera, hit);
      layers_.setCurvature(number, hit);
    } else {
      hit = shader_.groundHit(ray);
      if (!hit.found) continue;
    }
    const LightLattice::Estimate estimate = lattice.at(x, y, x + 0.5, y + 0.5, hit);
    if (options_.shadowSamples > 0 && estimate.isKeyKnown &&
        !LightLattice::isPenumbra(estimate.light))
      probes.push_back({i, estimate.light.key,
                        shader_.addShadowRays(hit, ray.direction, x, y, kProbes, shadowRays)});
  }
  if (layers_.light[0]) paintLight(tracer, pixels, views, seen);
  if (layers_.volume[0]) {
    const std::vector<VolumeLight> light = lightOfVolume(tracer, inVolume);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      layers_.setVolume(numberOf(pixels[i]), light[i]);
  }
  std::vector<char> contradicts(pixels.size(), 0);
  const std::vector<double> light = surfaces_.transmittances(tracer, shadowRays);
  for (const Probe& probe : probes) {
    const double found = Shader::lightOf(probe.range, shadowRays, light).key;
    // All probes of the pixel must contradict.
    contradicts[probe.pixel] = std::abs(found - probe.expected) > 0.9 ? 1 : 0;
  }
  return contradicts;
}

void KernelPainter::paintLight(const KernelTracer& tracer, const std::vector<Pixel>& pixels,
                               const std::vector<Camera::Ray>& views,
                               const std::vector<Hit>& seen) const {
  std::vector<LightRay> rays;
  std::vector<std::pair<std::size_t, LightRays>> ranges;  // with the numbers of the pixels
  const auto trace = [&] {
    const std::vector<double> light = surfaces_.transmittances(tracer, rays);
    for (const auto& [number, range] : ranges) {
      const PointLight found = Shader::lightOf(range, rays, light);
      layers_.setLight(number, found.sky, found.key);
    }
    rays.clear();
    ranges.clear();
  };
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!seen[i].found) continue;
    if (rays.size() > kMostLightRays) trace();
    const auto& [x, y] = pixels[i];
    ranges.emplace_back(numberOf(pixels[i]),
                        shader_.addPixelRays(seen[i], views[i].direction, x, y, rays));
  }
  trace();
}

void KernelPainter::paintColours(const KernelTracer& tracer, const std::vector<Pixel>& pixels,
                                 const LightLattice& lattice,
                                 const std::vector<char>& contradicts) const {
  const double middleX = scene_.camera.middleX(), middleY = 0.5 * scene_.camera.height;
  std::vector<ColourSum> sums(pixels.size());
  PixelBlock at(pixels.size());
  for (int s = 0; s < options_.samples; ++s) {
    std::vector<SampleRay> sampleRays;
    std::vector<Camera::Ray> views;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const V2d shift = PixelSequence::overArea(pixels[i].x, pixels[i].y).at(s);
      // Build the ray from the rounded position: the kernel reads pixel positions in single
      // precision.
      at.x[i] = static_cast<float>(pixels[i].x + shift.x - middleX);
      at.y[i] = static_cast<float>(pixels[i].y + shift.y - middleY);
      const double x = static_cast<double>(at.x[i]) + middleX,
                   y = static_cast<double>(at.y[i]) + middleY;
      const Camera::Ray ray = camera_.at(x, y);
      sampleRays.push_back({.ray = ray, .x = x, .y = y, .meshNear = ray.near, .lit = ray.near});
      views.push_back(ray);
    }
    const FirstHits first = firstHits(tracer, views);
    if (scene_.isOpaque()) {
      addSeen(tracer, pixels, s, castPixels(tracer, at), first, lattice, contradicts, sampleRays,
              sums);
      continue;
    }
    PixelTraversal walk = surfaces_.startTraversal(tracer, at);
    countOperands(walk.beziers);
    for (bool seesMore = true; seesMore;) {
      const PixelHits hits = surfaces_.castNext(tracer, walk);
      for (const std::size_t i :
           addSeen(tracer, pixels, s, hits, first, lattice, contradicts, sampleRays, sums))
        walk.solids.resume(i);
      seesMore = std::any_of(sampleRays.begin(), sampleRays.end(), [](const SampleRay& sampleRay) {
        return sampleRay.left >= kLeastTransmittance;
      });
    }
  }
  for (std::size_t i = 0; i < pixels.size(); ++i)
    layers_.setColour(numberOf(pixels[i]), sums[i], options_.samples);
}

std::vector<VolumeLight> KernelPainter::lightOfVolume(
    const KernelTracer& tracer, const std::vector<VolumeSegment>& segments) const {
  VolumeShading shading;
  shading.toLight = keyDirection(scene_);
  return tracer.volumeLight(scene_.volumePart->volume, segments,
                            scene_.volumePart->isShaded ? &shading : nullptr);
}

void KernelPainter::addVolume(const KernelTracer& tracer, const std::vector<Hit>& hits,
                              std::vector<SampleRay>& sampleRays,
                              std::vector<ColourSum>& sums) const {
  std::vector<VolumeSegment> segments;
  std::vector<std::size_t> numbers;  // of the rays of `segments`
  for (std::size_t i = 0; i < sampleRays.size(); ++i) {
    SampleRay& sampleRay = sampleRays[i];
    const Camera::Ray& ray = sampleRay.ray;
    const double far = hits[i].found ? hits[i].distance : ray.far;
    if (sampleRay.left < kLeastTransmittance || !(sampleRay.lit < far)) continue;
    segments.push_back({ray.origin, ray.direction, sampleRay.lit, far});
    numbers.push_back(i);
    sampleRay.lit = far;
  }
  const std::vector<VolumeLight> light = lightOfVolume(tracer, segments);
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    double& left = sampleRays[numbers[n]].left;
    sums[numbers[n]].add(light[n], left);
    left *= light[n].transmittance;
  }
}

std::vector<std::size_t> KernelPainter::addSeen(
    const KernelTracer& tracer, const std::vector<Pixel>& pixels, int sample, const PixelHits& hits,
    const FirstHits& first, const LightLattice& lattice, const std::vector<char>& contradicts,
    std::vector<SampleRay>& sampleRays, std::vector<ColourSum>& sums) const {
  struct Lit {
    std::size_t pixel;
    Hit hit;
    V3d direction;
    double share;
    LightLattice::Estimate estimate;
    LightRays range;
  };
  std::vector<std::size_t> throughSolids;
  std::vector<LightRay> rays;
  std::vector<Lit> points;
  const auto addColours = [&] {
    const std::vector<double> light = surfaces_.transmittances(tracer, rays);
    std::vector<SeenPoint> mirroring;
    std::vector<std::pair<std::size_t, double>> shares;  // parts of the pixels
    for (const Lit& point : points) {
      PointLight traced = Shader::lightOf(point.range, rays, light);
      if (point.estimate.isSkyKnown) traced.sky = point.estimate.light.sky;
      if (point.estimate.isKeyKnown) traced.key = point.estimate.light.key;
      if (point.hit.isOnGround) {
        sums[point.pixel].add(C3f(0), point.share * shader_.shadowOpacity(point.hit, traced));
        continue;
      }
      const C3f colour = shader_.colour(point.hit, point.direction, traced);
      if (!paths_) {
        sums[point.pixel].add(colour, point.share);
        continue;
      }
      const Pixel& pixel = pixels[point.pixel];
      mirroring.push_back({point.hit, point.direction, colour, pixel.x, pixel.y, sample});
      shares.emplace_back(point.pixel, point.share);
    }
    if (paths_) {
      const std::vector<C3f> colours = paths_->colours(AnyRays(*this, tracer), mirroring);
      for (std::size_t n = 0; n < colours.size(); ++n)
        sums[shares[n].first].add(colours[n], shares[n].second);
    }
    rays.clear();
    points.clear();
  };
  // The light of a volume lies in front of the hits, and may hide them.
  std::vector<Hit> behindVolume;
  if (scene_.volumePart) {
    behindVolume.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i)
      if (sampleRays[i].left >= kLeastTransmittance)
        behindVolume[i] =
            hitOf(sampleRays[i].ray, sampleRays[i].meshNear, hits, first, i, sampleRays[i].passed);
    addVolume(tracer, behindVolume, sampleRays, sums);
  }
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    auto& [ray, x, y, meshNear, left, lit, passed] = sampleRays[i];
    if (left < kLeastTransmittance) continue;
    if (rays.size() > kMostLightRays) addColours();
    Hit hit = scene_.volumePart ? behindVolume[i] : hitOf(ray, meshNear, hits, first, i, passed);
    if (!hit.found) hit = shader_.groundHit(ray);
    if (!hit.found) {
      left = 0;
      continue;
    }
    LightLattice::Estimate estimate = lattice.at(pixels[i].x, pixels[i].y, x, y, hit);
    if (contradicts[i]) estimate.isKeyKnown = false;
    LightRays range;
    if (!estimate.isSkyKnown || !estimate.isKeyKnown) {
      const LightKind kind = estimate.isSkyKnown   ? LightKind::Key
                             : estimate.isKeyKnown ? LightKind::Sky
                                                   : LightKind::Both;
      range = shader_.addRays(hit, ray.direction, pixels[i].x, pixels[i].y, sample, rays, kind);
    }
    points.push_back({i, hit, ray.direction, left * hit.opacity, estimate, range});
    left = hit.isOnGround ? 0 : left * (1 - hit.opacity);
    if (hit.isOnMesh)
      meshNear = hit.beyond();
    else if (surfaces_.isOnBezier(hit))
      ++passed;
    else if (left >= kLeastTransmittance)
      throughSolids.push_back(i);
  }
  addColours();
  return throughSolids;
}

Image paintPicture(const Scene& scene, const KernelScene& surfaces, const KernelTracer& tracer,
                   int tile, const std::string& renderer, const RenderOptions& options) {
  const Camera& camera = scene.camera;
  Image image(camera.width, camera.height);
  const KernelPainter painter(scene, surfaces, options, image);
  const int across = (camera.width + tile - 1) / tile, down = (camera.height + tile - 1) / tile;
  std::mutex reporting;
  int done = 0;
  tbb::parallel_for(0, across * down, [&](int number) {
    const int left = number % across * tile, top = number / across * tile;
    painter.paint(tracer, {left, top, std::min(left + tile, camera.width),
                           std::min(top + tile, camera.height)});
    const std::scoped_lock lock(reporting);
    levelset::report(options.progress, static_cast<double>(++done) / (across * down));
  });
  finishColours(image, scene, options, surfaces.bounds().size().length());
  image.attributes = sceneAttributes(scene, options);
  image.attributes["ls:renderer"] = renderer;
  image.attributes["ls:mode"] = "exact";
  if (surfaces.fields()) {
    image.attributes["ls:read"] =
        fmt::format("{} blocks of 8x8x8 cells where a field is not constant, {:.1f} MB",
                    surfaces.fields()->blockCount(), static_cast<double>(surfaces.bytes()) * 1e-6);
  } else if (surfaces.segmented() && surfaces.solids().empty()) {
    const InterfaceCaster& caster = surfaces.segmented()->caster;
    const std::string sheets =
        caster.sheetTriangleCount() > 0
            ? fmt::format("{} triangles of sheets, ", caster.sheetTriangleCount())
            : "";
    image.attributes["ls:read"] =
        fmt::format("{} cells with corners of several regions, {}{:.1f} MB",
                    caster.mixedCellCount(), sheets, static_cast<double>(surfaces.bytes()) * 1e-6);
  } else if (!surfaces.quadrics().empty() && surfaces.solids().empty()) {
    std::size_t count = 0;
    for (const QuadricPart& part : surfaces.quadrics()) count += part.caster.count();
    image.attributes["ls:read"] =
        fmt::format("{} quadrics, {:.1f} MB", count, static_cast<double>(surfaces.bytes()) * 1e-6);
  } else if (!surfaces.terrains().empty() && surfaces.solids().empty()) {
    double samples = 0;
    for (const TerrainPart& part : surfaces.terrains())
      samples += static_cast<double>(part.caster.field().heights.size());
    image.attributes["ls:read"] = fmt::format("terrain of {:.0f} samples, {:.1f} MB", samples,
                                              static_cast<double>(surfaces.bytes()) * 1e-6);
  } else if (!surfaces.beziers().empty() && surfaces.solids().empty()) {
    std::size_t parts = 0;
    for (const BezierPart& part : surfaces.beziers()) parts += part.caster.partCount();
    image.attributes["ls:read"] = fmt::format("{} parts of Bézier patches, {:.1f} MB", parts,
                                              static_cast<double>(surfaces.bytes()) * 1e-6);
  } else {
    const KernelScene::Counts& counts = surfaces.counts();
    image.attributes["ls:read"] = fmt::format(
        "{} blocks of 8x8x8 cells that the surface crosses and {} neighbouring blocks for its "
        "curvature, "
        "{:.1f} MB; {} other blocks are not stored, and {} crossed blocks are outside the view",
        counts.crossed, counts.halo, static_cast<double>(surfaces.bytes()) * 1e-6, counts.omitted,
        counts.culled);
  }
  addViewAttributes(image, scene, surfaces.tableBounds().size().length());
  painter.layers().addWarnings(image, scene);
  return image;
}

}  // namespace render
