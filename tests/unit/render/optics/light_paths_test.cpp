// Traced reflection and refraction: closed forms of mirrors, plates and balls.

#include "render/optics/light_paths.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "render/cpu/cpu_renderer.h"
#include "render/effects/effects.h"
#include "render/embree/embree_renderer.h"
#include "render/gpu/gpu_renderer.h"
#include "render/images/compare_images.h"
#include "render/optics/fresnel.h"
#include "tests/support/bezier_scenes.h"
#include "tests/support/effect_pictures.h"
#include "tests/support/environment_maps.h"
#include "tests/support/measured.h"
#include "tests/support/render_scenes.h"

namespace light_paths_test {

using Imath::V3d;
using support::directionLight;
using support::EnvironmentFile;
using namespace render;

constexpr double kMapError = 1.85e-5;  // interpolation in EnvironmentFile

RenderOptions optionsOf(const OpticsOptions& optics) {
  RenderOptions options{.samples = 1, .ambientSamples = 0, .shadowSamples = 0};
  options.optics = optics;
  return options;
}

/// Ray of the only sample of a pixel.
Camera::Ray sampleRay(const Camera& camera, int x, int y) {
  const Imath::V2d at = PixelSequence::overArea(x, y).at(0);
  return camera.ray(x + at.x, y + at.y);
}

V3d colourAt(const Image& image, int x, int y) {
  const auto i = static_cast<std::size_t>(y * image.width + x);
  return {static_cast<double>(image.channels.at("R")[i]),
          static_cast<double>(image.channels.at("G")[i]),
          static_cast<double>(image.channels.at("B")[i])};
}

double largest(const V3d& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// Largest difference of a picture from the colours of its rays in closed form, over the opaque
/// pixels. @param colour  empty: the pixel is left out
double errorOf(const Image& image, const Camera& camera,
               const std::function<std::optional<V3d>(const Camera::Ray&)>& colour) {
  double worst = 0;
  std::size_t count = 0;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (image.channels.at("A")[static_cast<std::size_t>(y * camera.width + x)] < 1) continue;
      const std::optional<V3d> exact = colour(sampleRay(camera, x, y));
      if (!exact) continue;
      worst = std::max(worst, largest(colourAt(image, x, y) - *exact));
      ++count;
    }
  EXPECT_GT(count, 300u);
  return worst;
}

/// Checks the pictures of the kernel and of the judge.
void expectError(const Scene& scene, const OpticsOptions& optics,
                 const std::function<std::optional<V3d>(const Camera::Ray&)>& colour,
                 double figure) {
  EXPECT_LT(errorOf(renderCpu(scene, optionsOf(optics)), scene.camera, colour),
            support::measured(figure));
  EXPECT_LT(errorOf(renderEmbree(scene, optionsOf(optics)), scene.camera, colour),
            support::measured(figure));
}

constexpr double kRadius = 20;

Camera ballCamera() {
  Camera camera;
  camera.from = V3d(20, 30, 70);
  camera.width = camera.height = 48;
  return camera;
}

/// A ball of radius 20 about the origin, as each kind of part.
Scene ballOf(const std::string& kind) {
  Scene scene;
  scene.camera = ballCamera();
  if (kind == "level set") {
    scene.solids.push_back({.band = levelset::makeSphere(kRadius, V3d(0), 0.5)});
  } else if (kind == "expression") {
    scene.solids.push_back(
        {.band = levelset::makeSphere(kRadius, V3d(0), 0.5), .id = 1, .name = "a"});
    scene.solids.push_back(
        {.band = levelset::makeSphere(kRadius + 3, V3d(0), 0.5), .id = 2, .name = "b"});
    scene.csg = CsgExpression("a & b", {"a", "b"});
  } else if (kind == "morph") {
    for (const std::uint32_t id : {1u, 2u})
      scene.solids.push_back({.band = levelset::makeSphere(kRadius, V3d(0), 0.5), .id = id});
    scene.morph = 0.5;
  } else if (kind == "quadric") {
    scene.quadrics.push_back(makeQuadricPart({{V3d(0), static_cast<float>(kRadius)}}, {}));
  } else {
    BezierVolume volume = bezier_scenes::sphere(2);
    bezier_scenes::deform(volume.patches[0], [](const V3d& p) { return p * kRadius; });
    scene.beziers.push_back({.caster = BezierCaster(std::move(volume))});
  }
  return scene;
}

TEST(LightPaths, ShowTheEnvironmentInAMirrorBall) {
  const EnvironmentFile map(directionLight);
  const OpticsOptions optics{.reflect = 1, .environment = map.name()};
  const struct {
    const char* kind;
    double error;
  } cases[] = {{"level set", 0.00112},
               {"expression", 0.00112},
               {"morph", 0.00112},
               {"quadric", kMapError},
               {"Bézier", kMapError}};
  for (const auto& [kind, error] : cases) {
    const Scene scene = ballOf(kind);
    const auto exact = [](const Camera::Ray& ray) -> std::optional<V3d> {
      const auto at = support::onBall(ray, V3d(0), kRadius);
      if (!at || -ray.direction.dot(at->normal) < 0.1) return {};
      return directionLight(ray.direction - at->normal * (2 * ray.direction.dot(at->normal)));
    };
    SCOPED_TRACE(kind);
    expectError(scene, optics, exact, error);
  }
}

/// A square of a mesh in the plane z = 0, which faces +z.
MeshPart mirrorPlate(double half) {
  auto mesh = std::make_shared<levelset::TriMesh>();
  mesh->positions = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  MeshPart part;
  part.mesh = mesh;
  return part;
}

TEST(LightPaths, ShowABallInAPlaneMirror) {
  // A mirror ball over a mirror. The path of each ray is a sequence of closed forms.
  const EnvironmentFile map(directionLight);
  const V3d centre(0, 0, 14);
  const double radius = 9, half = 400;
  Scene scene;
  scene.meshes.push_back(mirrorPlate(half));
  scene.quadrics.push_back(makeQuadricPart({{centre, static_cast<float>(radius)}}, {}));
  scene.camera.from = V3d(50, 10, 40);
  scene.camera.to = V3d(0, 0, 5);
  scene.camera.up = V3d(0, 0, 1);
  scene.camera.width = scene.camera.height = 64;
  std::size_t inMirror = 0;
  for (const int bounces : {1, 8}) {
    const auto exact = [&](const Camera::Ray& from) -> std::optional<V3d> {
      Camera::Ray ray = from;
      for (int n = 0; n < 20; ++n) {
        auto at = support::onBall(ray, centre, radius);
        const auto onPlate = support::onPlane(ray, V3d(0), V3d(0, 0, 1));
        const bool isPlate = !at && onPlate && std::abs(onPlate->position.x) < half &&
                             std::abs(onPlate->position.y) < half;
        if (isPlate) at = onPlate;
        if (!at) break;
        // Beside the outline of the ball, the direction depends on the position without limit.
        if (!isPlate && -ray.direction.dot(at->normal) < 0.3) return {};
        inMirror += n == 1 && !isPlate;
        ray = {at->position, ray.direction - at->normal * (2 * ray.direction.dot(at->normal))};
        ray.origin += at->normal * 1e-9;
        if (n == bounces) break;
      }
      return directionLight(ray.direction);
    };
    const OpticsOptions optics{.reflect = 1, .environment = map.name(), .bounces = bounces};
    EXPECT_LT(errorOf(renderCpu(scene, optionsOf(optics)), scene.camera, exact),
              support::measured(kMapError))
        << bounces;
  }
  EXPECT_GT(inMirror, 200u);
}

/// Light of a glass ball: the sum over its inner reflections.
std::optional<V3d> lightOfGlassBall(const Camera::Ray& ray, double index) {
  const auto at = support::onBall(ray, V3d(0), kRadius);
  if (!at || -ray.direction.dot(at->normal) < 0.3) return {};
  const double cosine = -ray.direction.dot(at->normal),
               inner = std::sqrt(1 - (1 - cosine * cosine) / (index * index));
  const double across = (cosine - index * inner) / (cosine + index * inner),
               along = (index * cosine - inner) / (index * cosine + inner);
  const double share = 0.5 * (across * across + along * along);
  V3d sum = directionLight(ray.direction + at->normal * (2 * cosine)) * share;
  V3d direction = ray.direction / index + at->normal * (cosine / index - inner),
      position = at->position;
  double left = 1 - share;
  while (left > 1e-12) {
    position += direction * (2 * kRadius * inner);
    const V3d normal = position / kRadius;
    // From within, the same angles appear on the other side.
    const V3d leaving = direction * index + normal * (cosine - index * inner);
    sum += directionLight(leaving) * (left * (1 - share));
    direction -= normal * (2 * direction.dot(normal));
    left *= share;
  }
  return sum;
}

TEST(LightPaths, OfAGlassBallHaveTheSumOfItsInnerReflections) {
  const EnvironmentFile map(directionLight);
  const OpticsOptions optics{.refract = 1, .index = 1.5, .environment = map.name()};
  const struct {
    const char* kind;
    double error;
  } cases[] = {{"level set", 5.9e-4},
               {"expression", 5.9e-4},
               {"morph", 5.9e-4},
               {"quadric", 5.3e-4},
               {"Bézier", 5.3e-4}};
  for (const auto& [kind, error] : cases) {
    const Scene scene = ballOf(kind);
    const auto exact = [](const Camera::Ray& ray) { return lightOfGlassBall(ray, 1.5); };
    SCOPED_TRACE(kind);
    expectError(scene, optics, exact, error);
  }
}

TEST(LightPaths, PassStraightThroughSolidsOfIndexOne) {
  const EnvironmentFile map(directionLight);
  const OpticsOptions optics{.refract = 1, .index = 1, .environment = map.name()};
  for (const char* kind : {"level set", "expression", "morph", "quadric", "Bézier"}) {
    const Scene scene = ballOf(kind);
    EXPECT_LT(errorOf(renderCpu(scene, optionsOf(optics)), scene.camera,
                      [](const Camera::Ray& ray) { return directionLight(ray.direction); }),
              support::measured(kMapError))
        << kind;
  }
}

TEST(LightPaths, LoseNoLight) {
  // In a furnace of even light, all that is clear or a mirror is invisible.
  const EnvironmentFile furnace([](const V3d&) { return V3d(0.7, 0.5, 0.25); }, 8);
  Scene scene = support::sceneOf(support::rings(), 60, 48);
  scene.quadrics.push_back(
      makeQuadricPart({{V3d(6, 0, 2), 7}}, {{V3d(-20, 0, 0), V3d(9, 9, 9), 4}}));
  for (const double reflect : {0.0, 0.3})
    for (const int bounces : {0, 2, 8}) {
      const OpticsOptions optics{.reflect = reflect,
                                 .refract = 1,
                                 .index = 1.5,
                                 .environment = furnace.name(),
                                 .bounces = bounces};
      EXPECT_LT(errorOf(renderCpu(scene, optionsOf(optics)), scene.camera,
                        [](const Camera::Ray&) { return V3d(0.7, 0.5, 0.25); }),
                support::rounding(4))
          << reflect << " " << bounces;
    }
}

TEST(LightPaths, SeeOverlappingSolidsAsTheirUnion) {
  // Paths in the overlap pass surfaces, each of which counts as a bounce.
  const EnvironmentFile map(directionLight);
  const OpticsOptions optics{.refract = 1, .index = 1.5, .environment = map.name(), .bounces = 40};
  Scene scene;
  scene.camera = ballCamera();
  scene.camera.from *= 1.6;
  scene.solids.push_back(
      {.band = levelset::makeSphere(14, V3d(-8, 0, 0), 0.5), .id = 1, .name = "a"});
  scene.solids.push_back(
      {.band = levelset::makeSphere(14, V3d(8, 0, 0), 0.5), .id = 2, .name = "b"});
  const Image parts = renderCpu(scene, optionsOf(optics));
  scene.csg = CsgExpression("a | b", {"a", "b"});
  const Image united = renderCpu(scene, optionsOf(optics));
  double sum = 0;
  std::size_t count = 0;
  for (int y = 0; y < united.height; ++y)
    for (int x = 0; x < united.width; ++x) {
      sum += largest(colourAt(parts, x, y) - colourAt(united, x, y));
      count += united.channels.at("A")[static_cast<std::size_t>(y * united.width + x)] > 0;
    }
  EXPECT_LT(sum / static_cast<double>(count), support::measured(0.00122));
}

/// A plate of glass between two heights, whose surfaces a test sees in closed form.
class GlassPlate : public SceneRays {
 public:
  GlassPlate(double low, double high) : low_(low), high_(high) {}
  [[nodiscard]] std::vector<Hit> firstHits(const std::vector<Camera::Ray>& rays) const override {
    std::vector<Hit> hits;
    for (const Camera::Ray& ray : rays) {
      asked.push_back(ray);
      hits.push_back(hitOf(ray));
    }
    return hits;
  }
  [[nodiscard]] std::vector<double> transmittances(
      const std::vector<LightRay>& rays) const override {
    return std::vector<double>(rays.size(), 1);
  }
  [[nodiscard]] Hit hitOf(const Camera::Ray& ray) const {
    Hit hit;
    for (const auto& [height, up] : {std::pair(low_, -1.0), {high_, 1.0}}) {
      const double t = (height - ray.origin.z) / ray.direction.z;
      if (!(t >= ray.near) || (hit.found && hit.distance < t)) continue;
      hit.found = true;
      hit.distance = t;
      hit.position = ray.origin + ray.direction * t;
      hit.normal = hit.facetNormal = V3d(0, 0, up);
      hit.surfaceError = 1e-3;
    }
    return hit;
  }
  mutable std::vector<Camera::Ray> asked;

 private:
  double low_, high_;
};

struct Traced {
  Scene scene;
  RenderOptions options;
  Shader shader{scene, 10, options};
};

TEST(LightPaths, LeaveAPlateParallelAndShiftedBySnellsLaw) {
  const double thickness = 2.5, index = 1.6;
  const GlassPlate plate(-thickness, 0);
  const Traced with{};
  const LightPaths paths(with.shader, 10, {.refract = 1, .index = index}, 1u << 30);
  for (const double angle : {0.0, 0.3, 0.9, 1.4}) {
    plate.asked.clear();
    const Camera::Ray ray{V3d(0, 0, 5), V3d(std::sin(angle), 0, -std::cos(angle))};
    (void)paths.colours(plate, {{plate.hitOf(ray), ray.direction}});
    const double inner = std::asin(std::sin(angle) / index);
    // The ray that leaves the plate downwards first.
    bool isFound = false;
    for (const Camera::Ray& left : plate.asked) {
      if (isFound || left.origin.z > -0.5 * thickness || left.direction.z > 0) continue;
      isFound = true;
      EXPECT_LT((left.direction - ray.direction).length(), support::doubleRounding(16));
      const V3d offset = left.origin - plate.hitOf(ray).position;
      const double shift = offset.cross(ray.direction).length();
      EXPECT_NEAR(shift, thickness * std::sin(angle - inner) / std::cos(inner), 1e-12) << angle;
    }
    EXPECT_TRUE(isFound) << angle;
  }
}

TEST(LightPaths, AreReflectedTotallyFromWithin) {
  const EnvironmentFile map(directionLight);
  const Traced with{};
  // Without bounces, the colour is that of the environment in the directions at the first surface.
  const LightPaths paths(with.shader, 10,
                         {.refract = 1, .index = 1.5, .environment = map.name(), .bounces = 0},
                         1u << 30);
  const GlassPlate plate(-4, 0);
  for (const double angle : {0.5, 0.8, 1.2}) {
    const Camera::Ray ray{V3d(0, 0, -1), V3d(std::sin(angle), 0, std::cos(angle))};
    const V3d seen(paths.colours(plate, {{plate.hitOf(ray), ray.direction}})[0]);
    const V3d mirror = directionLight(V3d(std::sin(angle), 0, -std::cos(angle)));
    if (std::sin(angle) > 1 / 1.5)
      EXPECT_LT(largest(seen - mirror), support::measured(kMapError)) << angle;
    else
      EXPECT_GT(largest(seen - mirror), 0.5) << angle;
  }
}

/// A scene with parts of all kinds that reflect and refract.
Scene mixedScene() {
  Scene scene = support::sceneOf(support::rings(), 60, 48);
  scene.meshes.push_back(mirrorPlate(60));
  scene.quadrics.push_back(makeQuadricPart({{V3d(6, 30, 12), 9}}, {}));
  BezierVolume volume = bezier_scenes::sphere(2);
  bezier_scenes::deform(volume.patches[0], [](const V3d& p) { return p * 8 + V3d(-30, 10, 20); });
  scene.beziers.push_back({.caster = BezierCaster(std::move(volume)), .opacity = 0.5});
  return scene;
}

TEST(LightPaths, AgreeBetweenKernelAndJudge) {
  const Scene scene = mixedScene();
  RenderOptions options = optionsOf({.reflect = 0.3, .refract = 0.5});
  options.ambientSamples = 4;
  options.shadowSamples = 2;
  const Image kernel = renderCpu(scene, options), judge = renderEmbree(scene, options);
  std::size_t different = 0;
  for (int y = 0; y < kernel.height; ++y)
    for (int x = 0; x < kernel.width; ++x)
      different += largest(colourAt(kernel, x, y) - colourAt(judge, x, y)) > 0.01;
  // Rays that graze an edge or a highlight.
  EXPECT_LT(static_cast<double>(different) / static_cast<double>(kernel.pixelCount()),
            support::measured(0.02))
      << different;
}

TEST(LightPaths, HaveTheSameBitsOnTheGpu) {
  const Scene scene = mixedScene();
  RenderOptions options = optionsOf({.reflect = 0.3, .refract = 0.5});
  options.shadowSamples = 1;
  const ImageComparison found =
      compareImages(renderGpu(scene, options), renderCpu(scene, options), {.exact = true});
  EXPECT_GT(found.bothHit, 500u);
  EXPECT_EQ(found.differentBits, 0u) << found.reason();
}

TEST(LightPaths, SeeSurfacesOutsideTheFrameInMirrors) {
  // The camera sees a plate. A ball behind the camera is in its mirror.
  Scene scene;
  scene.solids.push_back({.band = levelset::makeBox(V3d(30, 30, 4), V3d(0), 1)});
  scene.camera.from = V3d(0, 0, 40);
  scene.camera.width = scene.camera.height = 32;
  const EnvironmentFile dark([](const V3d&) { return V3d(0); }, 8);
  const RenderOptions options =
      optionsOf({.reflect = 0.9, .environment = dark.name(), .bounces = 1});
  const auto seen = [&] {
    const double kernel = colourAt(renderCpu(scene, options), 16, 16).y;
    EXPECT_NEAR(colourAt(renderEmbree(scene, options), 16, 16).y, kernel, 1e-5);
    return kernel;
  };
  const double without = seen();
  scene.solids.push_back({.band = levelset::makeSphere(20, V3d(0, 0, 80), 1), .id = 2});
  EXPECT_GT(seen(), 1.2 * without);
}

/// Root mean square of the difference of the colours of two pictures, over the pixels with a
/// surface.
double rmsOf(const Image& a, const Image& b) {
  double sum = 0;
  std::size_t count = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      if (!std::isfinite(a.channels.at("Z")[static_cast<std::size_t>(y * a.width + x)])) continue;
      sum += (colourAt(a, x, y) - colourAt(b, x, y)).length2() / 3;
      ++count;
    }
  return std::sqrt(sum / static_cast<double>(count));
}

TEST(LightPaths, ShowTheErrorOfTheEffectInThePicture) {
  const auto ballOnPlate = levelset::unite(levelset::makeSphere(10, V3d(0, 10, 0), 0.5),
                                           levelset::makeBox(V3d(60, 4, 60), V3d(0, -2, 0), 0.5));
  const auto pot = levelset::subtract(levelset::makeCylinder(20, 30, V3d(0), V3d(0, 1, 0), 0.7),
                                      levelset::makeSphere(16, V3d(0, 15, 0), 0.7));
  struct Errors {
    double effect, none;  ///< errors of the pictures with and without the effect
  };
  const struct {
    const char* name;
    Scene scene;
    Errors mirror, glass;  // docs/effects.md has these figures
  } cases[] = {{"one ball",
                support::sceneOf(levelset::makeSphere(10, V3d(0), 0.5)),
                {0.0225, 0.551},
                {0.107, 0.32}},
               {"rings", support::sceneOf(support::rings()), {0.268, 0.53}, {0.281, 0.334}},
               {"ball on a plate", support::sceneOf(ballOnPlate), {0.217, 0.321}, {0.147, 0.363}},
               {"pot", support::sceneOf(pot), {0.0813, 0.259}, {0.341, 0.312}}};
  for (const auto& [name, scene, mirror, glass] : cases)
    for (const bool isGlass : {false, true}) {
      RenderOptions options{.samples = 4, .ambientSamples = 4, .shadowSamples = 2};
      const Image plain = renderCpu(scene, options);
      options.optics.reflect = isGlass ? 0 : 0.6;
      options.optics.refract = isGlass ? 1 : 0;
      const Image traced = renderCpu(scene, options);
      EffectOptions effects;
      effects.reflect = options.optics.reflect;
      effects.refract = options.optics.refract;
      const Image screen = withEffects(plain, {}, effects, CpuScreenRunner());
      const Errors& figures = isGlass ? glass : mirror;
      EXPECT_LT(rmsOf(traced, screen), support::measured(figures.effect)) << name << isGlass;
      EXPECT_NEAR(rmsOf(traced, plain), figures.none, 0.1 * figures.none) << name << isGlass;
    }
}

TEST(LightPaths, RefuseWhatTheyCannotTrace) {
  const Scene scene = ballOf("quadric");
  const auto refuses = [&](const OpticsOptions& optics, Style style = Style::Lit) {
    RenderOptions options = optionsOf(optics);
    options.style.style = style;
    EXPECT_THROW((void)renderCpu(scene, options), levelset::UsageError);
    EXPECT_THROW((void)renderEmbree(scene, options), levelset::UsageError);
  };
  refuses({.reflect = 1.1});
  refuses({.reflect = -0.1, .refract = 1});
  refuses({.refract = 2});
  refuses({.refract = 1, .index = 0.9});
  refuses({.reflect = 1, .bounces = 65});
  refuses({.reflect = 1, .bounces = -1});
  refuses({.reflect = 1}, Style::CurvatureLines);
  EXPECT_THROW((void)renderCpu(scene, optionsOf({.reflect = 1, .environment = "no-such-room.exr"})),
               levelset::IoError);
}

}  // namespace light_paths_test
