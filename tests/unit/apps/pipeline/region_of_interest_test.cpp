// Each operator computes the same region of interest as of the complete result, to the bit.

#include "apps/pipeline/graph/regions_of_interest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"
#include "tests/support/regions.h"

namespace region_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::NarrowBand;
using levelset::RegionOfInterest;
using pipeline::Operator;
using pipeline::Value;
using support::between;
using support::expectSamePart;
using support::pointIn;
using support::text;
using Random = std::mt19937;

/// A random solid of several shapes with edges, ridges and hollows, in voxels of 0.1.
NarrowBand someSolid(Random& random, double halfWidth) {
  using namespace levelset;
  const ShapeOptions options{.halfWidth = halfWidth};
  NarrowBand solid = makeBox(V3d(between(random, 1.6, 3), between(random, 1.6, 3), 1.53),
                             pointIn(random, 0.4), 0.1, options);
  solid = unite(solid, makeTorus(1.2, 0.4, pointIn(random, 0.5), V3d(0.3, 0.2, 1), 0.1, options));
  return subtract(solid, makeSphere(0.7, pointIn(random, 1.1), 0.1, options));
}

/// A random solid of one to three turned boxes, in voxels of 0.1. Its faces meet at many angles.
NarrowBand sharpSolid(Random& random, double halfWidth) {
  using namespace levelset;
  const auto turnedBox = [&] {
    const V3d size(between(random, 0.8, 3), between(random, 0.8, 3), between(random, 0.8, 3));
    Imath::M44d turn;
    turn.setEulerAngles(pointIn(random, 3));
    turn.translate(pointIn(random, 0.7));
    return bake(makeBox(size, V3d(0), 0.1, {.halfWidth = halfWidth}), turn, 0.1);
  };
  NarrowBand solid = turnedBox();
  if (random() % 2) solid = unite(solid, turnedBox());
  if (random() % 2) {
    NarrowBand less = subtract(solid, turnedBox());
    if (!less.isEmpty()) solid = less;
  }
  return solid;
}

/// Many calls of each operator that supports a region of interest.
using Options = std::map<std::string, std::string>;
const std::map<std::string, std::function<Options(Random&)>> kCalls = {
    {"union", [](Random&) { return Options{}; }},
    {"intersection", [](Random&) { return Options{}; }},
    {"difference", [](Random&) { return Options{}; }},
    {"offset",
     [](Random& random) {
       return Options{{"distance", std::to_string(between(random, -0.35, 0.9))}};
     }},
    {"emboss",
     [](Random& random) {
       static int call = 0;
       const char* const profiles[] = {"round", "flat", "sharp", "smooth"};
       return Options{{"curve", text(pointIn(random, 1.5)) + " " + text(pointIn(random, 1.5))},
                      {"width", std::to_string(between(random, 0.4, 0.8))},
                      {"height", std::to_string(between(random, -0.3, 0.4))},
                      {"profile", profiles[call++ % 4]}};
     }},
    {"clip",
     [](Random& random) {
       const V3d low = pointIn(random, 1) - V3d(0.5);
       if (random() % 3 == 0) return Options{{"plane", text(low) + " 1,0.4,-0.2"}};
       return Options{{"box", text(low) + " " + text(low + V3d(2.2, 1.7, 2.8))}};
     }},
    {"transform",
     [](Random& random) {
       return Options{{"rotate", std::to_string(between(random, 0, 360))},
                      {"scale", std::to_string(between(random, 0.5, 2))},
                      {"translate", text(pointIn(random, 3))}};
     }},
    {"transform --bake",
     [](Random& random) {
       return Options{{"rotate", std::to_string(between(random, 0, 360))},
                      {"scale", text(V3d(1) + pointIn(random, 0.4))},
                      {"translate", text(pointIn(random, 3))},
                      {"bake", ""}};
     }},
    {"mesh", [](Random&) { return Options{}; }},
    {"reinitialize",
     [](Random& random) {
       return random() % 2 ? Options{}
                           : Options{{"half-width", std::to_string(between(random, 2, 9))}};
     }},
    {"rebuild-band",
     [](Random& random) {
       return Options{{"half-width", std::to_string(between(random, 2, 14))}};
     }},
    {"open",
     [](Random& random) {
       return Options{{"radius", std::to_string(between(random, 0.02, 0.35))}};
     }},
    {"close",
     [](Random& random) {
       return Options{{"radius", std::to_string(between(random, 0.02, 0.35))}};
     }},
    {"shell",
     [](Random& random) {
       static int call = 0;
       const char* const sides[] = {"in", "out", "both"};
       return Options{{"thickness", std::to_string(between(random, 0.12, 0.4))},
                      {"side", sides[call++ % 3]}};
     }},
    {"smooth",
     [](Random& random) {
       static int call = 0;
       const char* const kinds[] = {"gaussian", "mean", "median", "taubin"};
       return Options{{"sigma", std::to_string(between(random, 0.05, 0.3))},
                      {"kind", kinds[call++ % 4]}};
     }},
    {"resample",
     [](Random& random) {
       return Options{{"voxel", std::to_string(between(random, 0.06, 0.15))}};
     }},
};

/// @return number of compared values
/// @param tolerance  voxels
std::size_t tryOperator(const Operator& op, const std::function<Options(Random&)>& call,
                        unsigned seed, double tolerance,
                        const std::function<NarrowBand(Random&, double)>& makeSolid = someSolid,
                        std::optional<double> fixedHalfWidth = {}) {
  Random random(seed);
  const double halfWidth = fixedHalfWidth  ? *fixedHalfWidth
                           : seed % 4 == 3 ? between(random, 1.5, 3)
                                           : between(random, 3, 8);
  const Options options = call(random);
  pipeline::Invocation whole(op, options);
  for (std::size_t i = 0; i < op.operands.size(); ++i)
    whole.operands.emplace_back(makeSolid(random, halfWidth));
  const std::vector<Value> operands = whole.operands;
  Value all = operands[0];
  try {
    all = op.run(whole);
  } catch (const levelset::InvalidInput&) {
    return 0;  // the result is empty
  }
  RegionOfInterest of;
  if (all.kind() == pipeline::Kind::Band) {
    if (random() % 2) of.halfWidth = between(random, 1, halfWidth);
    if (random() % 4) {
      const Box3d bounds = all.plan().bounds;
      const V3d low = bounds.min + (bounds.size() * pointIn(random, 0.5) + bounds.size() / 2) * 0.8;
      of.region = Box3d(low, low + bounds.size() * between(random, 0.2, 0.6));
    }
  }
  pipeline::Invocation part(op, options);
  part.operands = operands;
  part.planned = all.plan();
  part.roi = of;
  std::vector<Value> less;
  for (std::size_t i = 0; i < operands.size(); ++i) {
    const RegionOfInterest read = op.regionOfInterest(part, i, of);
    less.emplace_back(levelset::cropped(operands[i].band(), read));
    if (less.back().band().isEmpty()) return 0;  // it would be computed completely
  }
  part.operands = less;
  part.isPartial = less[0].band().halfWidth() < operands[0].band().halfWidth() * (1 - 1e-5);
  const std::string what = op.name + " " + std::to_string(seed) + ", half width " +
                           std::to_string(of.halfWidth) + " of " + std::to_string(halfWidth) +
                           (levelset::isEverywhere(of.region) ? "" : ", in a region");
  Value made = all;
  try {
    made = op.run(part);
  } catch (const levelset::InvalidInput&) {
    return 0;  // the complete result is refused too
  }
  if (all.kind() == pipeline::Kind::Mesh) {
    EXPECT_TRUE(all.mesh().positions == made.mesh().positions) << what;
    EXPECT_TRUE(all.mesh().triangles == made.mesh().triangles) << what;
    return all.mesh().triangles.size();
  }
  // Thin bands are widened, and the region is widened separately, which permits larger differences.
  // Tolerance of thick bands, voxels.
  constexpr double kOfThickBands = 1e-6;
  if (halfWidth >= 3) tolerance = op.name == "offset" ? 0 : std::min(tolerance, kOfThickBands);
  return expectSamePart(all.band(), levelset::cropped(made.band(), of), of, tolerance, what);
}

/// Compares regions of all operators with the complete results.
/// @param first, end  seeds for operators that are compared to the bit; the others take half as
///                    many, because they take longer
void expectEqualRegions(unsigned first, unsigned end) {
  for (const Operator& op : pipeline::operators()) {
    if (!op.regionOfInterest || op.flow == pipeline::Flow::PassesThrough) continue;  // tested below
    ASSERT_TRUE(kCalls.contains(op.name))
        << op.name << " supports a region of interest, but has no test call";
  }
  for (const auto& [name, call] : kCalls) {
    const Operator& op = *pipeline::findOperator(name.substr(0, name.find(' ')));
    ASSERT_TRUE(op.regionOfInterest) << name;
    const double tolerance = name == "transform" ? 0 : op.partTolerance;
    const unsigned share = tolerance == 0 || name == "offset" ? 1 : 2;
    unsigned compared = 0;
    for (unsigned seed = first / share; seed < end / share; ++seed)
      compared += tryOperator(op, call, seed, tolerance) > 100 ? 1 : 0;
    EXPECT_GE(compared, (end - first) / share / 2) << name;
  }
}

TEST(RegionOfInterest, EveryOperatorComputesTheSameRegion) {
  expectEqualRegions(0, 8);
}

TEST(SlowRegionOfInterest, EveryOperatorComputesTheSameRegion) {
  expectEqualRegions(8, 24);
}

/// Compares regions of offsets of random solids with the complete result, for the seeds from
/// `first` to `end`.
void expectEqualOffsets(unsigned first, unsigned end) {
  const Operator& op = *pipeline::findOperator("offset");
  const auto call = [](Random& random) {
    const double distance = between(random, 0.2, 0.8) * (random() % 3 ? 1 : -1);
    return Options{{"distance", std::to_string(distance)}};
  };
  for (const auto& makeSolid : {someSolid, sharpSolid}) {
    unsigned compared = 0;
    for (unsigned seed = first; seed < end; ++seed)
      compared += tryOperator(op, call, seed, 0, makeSolid, seed % 2 ? 3 : 5) > 100 ? 1 : 0;
    EXPECT_GE(compared, (end - first) / 2);
  }
}

TEST(RegionOfInterest, OffsetsHaveEqualBits) {
  expectEqualOffsets(0, 4);
}

TEST(SlowRegionOfInterest, OffsetsHaveEqualBits) {
  expectEqualOffsets(4, 60);
}

}  // namespace region_test
