#include "render/shading/shading.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/shading/sampling.h"

namespace render {
namespace {

using Imath::C3f;
using Imath::V2d;
using Imath::V3d;

// Length of occlusion rays relative to the diagonal of the surfaces' box: hollows darken, open
// surfaces do not.
constexpr double kOcclusionShare = 0.25;
constexpr std::uint64_t kAmbient = 1, kShadow = 2;

std::uint64_t scramble(std::uint64_t x) {  // the finaliser of SplitMix64
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

double unitInterval(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

/// Mean of max(0, n·d) over the directions d of a cone, for a unit vector n. The mean over a circle
/// of the cone has a closed form. @param cosine  of the angle between n and the cone's axis
double meanCosine(double cosine, double halfAngle) {
  constexpr int kCircles = 32;
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  double sum = 0;
  for (int i = 0; i < kCircles; ++i) {
    const double c = 1 - (i + 0.5) / kCircles * (1 - std::cos(halfAngle));
    const double middle = cosine * c, amplitude = sine * std::sqrt(1 - c * c);
    if (middle >= amplitude) {
      sum += middle;
    } else if (middle > -amplitude) {
      const double end = std::acos(-middle / amplitude);
      sum += (middle * end + amplitude * std::sin(end)) / std::numbers::pi;
    }
  }
  return sum / kCircles;
}

C3f scaled(const C3f& colour, double factor) {
  return colour * static_cast<float>(factor);
}

}  // namespace

PixelSequence::PixelSequence(int x, int y, std::uint64_t purpose) {
  const auto ux = static_cast<std::uint64_t>(x), uy = static_cast<std::uint64_t>(y);
  const std::uint64_t first = scramble(scramble(ux) ^ (uy << 20) ^ (purpose << 60));
  start_ = {unitInterval(first), unitInterval(scramble(first))};
}

V2d PixelSequence::at(int index) const {
  constexpr double kPlastic = 1.32471795724474602596;
  const double x = start_.x + index / kPlastic, y = start_.y + index / (kPlastic * kPlastic);
  return {x - std::floor(x), y - std::floor(y)};
}

V3d keyDirection(const Scene& scene) {
  const V3d forward = scene.camera.axis();
  const V3d right = forward.cross(scene.camera.up).normalized(), up = right.cross(forward);
  const V3d& d = scene.key.direction;
  return (right * d.x + up * d.y - forward * d.z).normalized();
}

double occlusionDistance(double diagonal) {
  return kOcclusionShare * diagonal;
}

Shader::Shader(const Scene& scene, double diagonal, const RenderOptions& options)
    : scene_(scene), options_(options), diagonal_(diagonal) {
  const V3d forward = scene.camera.axis();
  right_ = forward.cross(scene.camera.up).normalized();
  up_ = right_.cross(forward);
  const V3d& d = scene.key.direction;
  key_ = keyDirection(scene);
  fill_ = (right_ * -d.x + up_ * (0.3 * d.y) - forward * d.z).normalized();
  curvatureRange_ = curvatureRangeOf(options.style, diagonal);
  constexpr int kSteps = 1024;
  for (int i = 0; i <= kSteps; ++i)
    keyCosines_.push_back(meanCosine(2.0 * i / kSteps - 1, scene.key.softness));
}

double Shader::keyCosine(double cosine) const {
  const double at =
      (std::clamp(cosine, -1.0, 1.0) + 1) / 2 * static_cast<double>(keyCosines_.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), keyCosines_.size() - 2);
  const double share = at - static_cast<double>(i);
  return keyCosines_[i] * (1 - share) + keyCosines_[i + 1] * share;
}

Shader::Frame Shader::frameOf(const Hit& hit, const V3d& direction) const {
  Frame frame{hit.position, hit.normal, hit.facetNormal};
  if (frame.facet.dot(direction) > 0) frame.facet = -frame.facet;
  if (frame.normal.dot(frame.facet) < 0) frame.normal = -frame.normal;
  // Move the start of light rays away from the surface, beyond the ripples of the trilinear
  // interpolant and the rounding error of the hit.
  frame.start += frame.facet * (2 * hit.surfaceError + 1e-9 * diagonal_);
  return frame;
}

void Shader::addSkyRays(const Frame& frame, int x, int y, int sample,
                        std::vector<LightRay>& rays) const {
  const int count = options_.ambientSamples;
  const PixelSequence sequence(x, y, kAmbient);
  for (int i = 0; i < count; ++i) {
    V3d d = cosineDirection(frame.normal, sequence.at(sample * count + i));
    // The hemisphere around the smooth normal extends below the plane of the drawn facet. Mirror
    // directions that point below that plane.
    const double below = d.dot(frame.facet);
    if (below < 0) d = (d - frame.facet * (2 * below)).normalized();
    rays.push_back({frame.start, d, occlusionDistance(diagonal_), 1});
  }
}

double Shader::addKeyRays(const Frame& frame, int x, int y, int first, int count,
                          std::vector<LightRay>& rays) const {
  const PixelSequence sequence(x, y, kShadow);
  double behind = 0;
  for (int i = first; i < first + count; ++i) behind += addKeyRay(frame, sequence.at(i), rays);
  return behind;
}

double Shader::addKeyRay(const Frame& frame, const V2d& u, std::vector<LightRay>& rays) const {
  const V3d d = coneDirection(key_, scene_.key.softness, u);
  const double cosine = frame.normal.dot(d);
  if (cosine <= 0) return 0;
  if (frame.facet.dot(d) <= 0) return cosine;
  rays.push_back({frame.start, d, 4 * diagonal_, cosine});
  return 0;
}

LightRays Shader::addRays(const Hit& hit, const V3d& direction, int x, int y, int sample,
                          std::vector<LightRay>& rays, LightKind kind) const {
  LightRays range;
  range.first = rays.size();
  if (!usesLights(options_.style.style)) return range;
  const Frame frame = frameOf(hit, direction);
  if (kind != LightKind::Key) addSkyRays(frame, x, y, sample, rays);
  range.sky = rays.size() - range.first;
  if (kind != LightKind::Sky)
    range.behind =
        addKeyRays(frame, x, y, sample * options_.shadowSamples, options_.shadowSamples, rays);
  range.key = rays.size() - range.first - range.sky;
  return range;
}

LightRays Shader::addShadowRays(const Hit& hit, const V3d& direction, int x, int y, int count,
                                std::vector<LightRay>& rays) const {
  LightRays range;
  range.first = rays.size();
  range.behind = addKeyRays(frameOf(hit, direction), x, y, 0, count, rays);
  range.key = rays.size() - range.first;
  return range;
}

LightRays Shader::addPixelRays(const Hit& hit, const V3d& direction, int x, int y,
                               std::vector<LightRay>& rays) const {
  LightRays range;
  range.first = rays.size();
  const Frame frame = frameOf(hit, direction);
  for (int s = 0; s < options_.samples; ++s) addSkyRays(frame, x, y, s, rays);
  range.sky = rays.size() - range.first;
  range.behind = addKeyRays(frame, x, y, 0, options_.samples * options_.shadowSamples, rays);
  range.key = rays.size() - range.first - range.sky;
  return range;
}

PointLight Shader::lightOf(const LightRays& range, const std::vector<LightRay>& rays,
                           const std::vector<double>& transmittances) {
  const auto shareOf = [&](std::size_t first, std::size_t count, double behind) {
    double sum = 0, all = behind;
    for (std::size_t i = first; i < first + count; ++i) {
      sum += rays[i].light * transmittances[i];
      all += rays[i].light;
    }
    return all > 0 ? sum / all : 1;
  };
  return {shareOf(range.first, range.sky, 0),
          shareOf(range.first + range.sky, range.key, range.behind)};
}

C3f Shader::colour(const Hit& hit, const V3d& direction, const PointLight& light) const {
  const Frame frame = frameOf(hit, direction);
  switch (options_.style.style) {
    case Style::Tone:
      return toneColour(hit, frame, direction);
    case Style::Ink:
      return inkColour(hit, frame, direction);
    case Style::Matcap:
      return matcapColour(frame);
    case Style::ReflectionLines:
      return reflectionColour(frame, direction);
    default:
      break;
  }
  return litColour(hit, frame, direction, light);
}

Hit Shader::groundHit(const Camera::Ray& ray) const {
  Hit hit;
  if (!scene_.ground || !usesLights(options_.style.style)) return hit;
  const Ground& ground = *scene_.ground;
  const double descent = -ray.direction.dot(ground.normal);
  if (!(descent > 0)) return hit;
  hit.distance = (ray.origin - ground.point).dot(ground.normal) / descent;
  hit.position = ray.origin + ray.direction * hit.distance;
  if (!(hit.distance >= ray.near && hit.distance <= ray.far) ||
      !((hit.position - ground.point).length() <= ground.radius))
    return hit;
  hit.found = hit.isOnGround = true;
  hit.normal = hit.facetNormal = ground.normal;
  return hit;
}

double Shader::shadowOpacity(const Hit& hit, const PointLight& light) const {
  const double key = scene_.key.strength * keyCosine(hit.normal.dot(key_)),
               all = scene_.ambient + key;
  return all > 0 ? 1 - (scene_.ambient * light.sky + key * light.key) / all : 0;
}

C3f Shader::albedoOf(const Hit& hit) const {
  const C3f& own = hit.colour;
  switch (options_.style.style) {
    case Style::Mean:
      return meanColour(hit.curvature, curvatureRange_);
    case Style::Gauss:
      return gaussColour(hit.curvature, curvatureRange_);
    case Style::Principal:
      return principalColour(hit.curvature, curvatureRange_);
    case Style::Directions: {
      const V3d& first = hit.curvature.direction1;
      return directionColour(options_.style.direction == 2 ? hit.normal.cross(first) : first,
                             directionWeight(hit.curvature.k1, hit.curvature.k2, curvatureRange_));
    }
    case Style::Accessibility:
      return scaled(own, accessibilityOf(hit.curvature, curvatureRange_));
    default:
      return own;
  }
}

C3f Shader::litColour(const Hit& hit, const Frame& frame, const V3d& direction,
                      const PointLight& light) const {
  const C3f albedo = albedoOf(hit);
  const double open = light.sky;
  const double key = scene_.key.strength * light.key * keyCosine(frame.normal.dot(key_));
  const double facing = std::clamp(-direction.dot(frame.normal), 0.0, 1.0);
  const double upward = 0.5 + 0.5 * frame.normal.dot(up_);
  const double fill = 0.5 * scene_.ambient * std::max(0.0, frame.normal.dot(fill_));
  const double rim = 0.25 * scene_.ambient * std::pow(1 - facing, 4) * upward * open;
  const V3d half = (key_ - direction).normalized();
  const double gloss =
      key > 0 ? 0.08 * key * std::pow(std::max(0.0, half.dot(frame.normal)), 32) : 0;

  const C3f sky = C3f(0.86f, 0.94f, 1.06f) * static_cast<float>(upward) +
                  C3f(0.50f, 0.45f, 0.41f) * static_cast<float>(1 - upward);
  C3f result = scaled(C3f(1.06f, 1.0f, 0.90f), key);
  for (int c = 0; c < 3; ++c) {
    // Factor of the sky light with interreflection in a hollow that has the surface's colour. It is
    // 1 where nothing blocks the sky.
    const double bounced = open > 0 ? open / (1 - static_cast<double>(albedo[c]) * (1 - open)) : 0;
    result[c] += static_cast<float>(bounced) * static_cast<float>(scene_.ambient) * sky[c];
  }
  result += scaled(C3f(0.82f, 0.92f, 1.10f), fill * open);
  return albedo * result + C3f(static_cast<float>(rim + gloss));
}

double Shader::lineAt(const Hit& hit, const Frame& frame, const V3d& direction) const {
  const Camera& camera = scene_.camera;
  const double depth = camera.orthoHeight ? 1 : (hit.position - camera.from).dot(camera.axis());
  const double width = options_.style.lineWidth * camera.pixelSteps().right.length() * depth;
  const double cosine = std::clamp(-direction.dot(frame.normal), 0.0, 1.0);
  return silhouetteOf(cosine, hit.viewCurvature, width);
}

C3f Shader::toneColour(const Hit& hit, const Frame& frame, const V3d& direction) const {
  const C3f& own = hit.colour;
  const C3f cool = C3f(0.02f, 0.03f, 0.22f) + scaled(own, 0.25),
            warm = C3f(0.16f, 0.13f, 0.0f) + scaled(own, 0.75);
  const double share = 0.5 + 0.5 * frame.normal.dot(key_);
  const V3d half = (key_ - direction).normalized();
  const double gloss = 0.35 * std::pow(std::max(0.0, half.dot(frame.normal)), 64);
  const C3f colour = cool + scaled(warm - cool, share) + C3f(static_cast<float>(gloss));
  return scaled(colour, 1 - lineAt(hit, frame, direction));
}

C3f Shader::inkColour(const Hit& hit, const Frame& frame, const V3d& direction) const {
  const C3f paper(0.86f, 0.83f, 0.75f), ink(0.02f, 0.02f, 0.03f), sepia(0.32f, 0.16f, 0.06f);
  const double light = frame.normal.dot(key_);
  C3f colour = scaled(paper, light > 0.35 ? 1 : light > -0.1 ? 0.82 : 0.62);
  const auto mark = [&](const C3f& with, double amount) {
    colour += scaled(with - colour, std::clamp(amount, 0.0, 1.0));
  };
  // A point is a ridge if the principal curvature k1 exceeds −k2, and a valley if it is below. A
  // convex corner counts as a ridge.
  const double ridge = hit.curvature.k1 / curvatureRange_,
               valley = -hit.curvature.k2 / curvatureRange_;
  mark(sepia, ridge > valley ? 1.5 * (ridge - 1) : 0);
  mark(ink, valley > ridge ? 1.5 * (valley - 1) : 0);
  mark(ink, lineAt(hit, frame, direction));
  return colour;
}

C3f Shader::matcapColour(const Frame& frame) const {
  return options_.style.matcap->at(0.5 + 0.49 * frame.normal.dot(right_),
                                   0.5 - 0.49 * frame.normal.dot(up_));
}

C3f Shader::reflectionColour(const Frame& frame, const V3d& direction) const {
  return reflectionLinesColour(frame.normal, direction, up_, right_,
                               options_.style.reflectionLines);
}

}  // namespace render
