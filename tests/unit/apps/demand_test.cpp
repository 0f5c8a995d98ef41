// Only what is needed of a value is made, and it is the same to the bit.

#include "apps/pipeline/demand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "apps/pipeline/chain.h"
#include "apps/pipeline/invocation.h"
#include "apps/pipeline/runner.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/solids/csg.h"
#include "levelset/solids/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/shell.h"

namespace demand_test {

using Imath::Box3d;
using Imath::V3d;
using levelset::BandPart;
using levelset::NarrowBand;
using pipeline::Demand;
using pipeline::Graph;
using pipeline::Operator;
using pipeline::Value;
using Random = std::mt19937;

double between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
V3d pointIn(Random& random, double r) {
  return {between(random, -r, r), between(random, -r, r), between(random, -r, r)};
}
std::string text(const V3d& p) {
  return std::to_string(p.x) + "," + std::to_string(p.y) + "," + std::to_string(p.z);
}

// === One operator at a time

/// A solid of a few shapes, with edges, ridges and hollows; voxels of 0.1.
NarrowBand someSolid(Random& random, double halfWidth) {
  using namespace levelset;
  const ShapeOptions options{.halfWidth = halfWidth};
  NarrowBand solid = makeBox(V3d(between(random, 2, 4), between(random, 2, 4), 2.13),
                             pointIn(random, 0.5), 0.1, options);
  solid = unite(solid, makeTorus(1.6, 0.5, pointIn(random, 0.7), V3d(0.3, 0.2, 1), 0.1, options));
  return subtract(solid, makeSphere(0.9, pointIn(random, 1.5), 0.1, options));
}

/// How to call an operator that reads parts, in many ways.
using Options = std::map<std::string, std::string>;
const std::map<std::string, std::function<Options(Random&)>> kCalls = {
    {"union", [](Random&) { return Options{}; }},
    {"intersection", [](Random&) { return Options{}; }},
    {"difference", [](Random&) { return Options{}; }},
    {"offset",
     [](Random& random) {
       return Options{{"distance", std::to_string(between(random, -0.35, 0.9))}};
     }},
    {"clip",
     [](Random& random) {
       const V3d low = pointIn(random, 1.5);
       if (random() % 3 == 0) return Options{{"plane", text(low) + " 1,0.4,-0.2"}};
       return Options{{"box", text(low) + " " + text(low + V3d(2.2, 1.7, 2.8))}};
     }},
    {"transform",
     [](Random& random) {
       return Options{{"rotate", std::to_string(between(random, 0, 360))},
                      {"scale", std::to_string(between(random, 0.5, 2))},
                      {"translate", text(pointIn(random, 3))}};
     }},
    {"mesh", [](Random&) { return Options{}; }},
};

/// The part of two bands is the same, voxel by voxel.
/// @param tolerance  voxels
void expectSamePart(const NarrowBand& whole, const NarrowBand& made, const BandPart& part,
                    double tolerance, const std::string& what) {
  const NarrowBand wanted = levelset::cropped(whole, {.halfWidth = part.halfWidth});
  ASSERT_EQ(vdb(wanted).background(), vdb(made).background()) << what;
  openvdb::CoordBBox box = vdb(whole).evalActiveVoxelBoundingBox();
  if (!levelset::isEverywhere(part.region)) {
    const openvdb::CoordBBox blocks = levelset::blocksOf(part.region, vdb(whole).transform());
    box.intersect({blocks.min().offsetBy(8), blocks.max().offsetBy(-8)});  // all of it within
  }
  auto a = vdb(wanted).getConstAccessor(), b = vdb(made).getConstAccessor();
  std::size_t different = 0;
  double largest = 0;
  for (auto c = box.begin(); c; ++c) {
    float u = 0, v = 0;
    const bool uOn = a.probeValue(*c, u), vOn = b.probeValue(*c, v);
    const double apart = static_cast<double>(std::abs(u - v)) / whole.voxelSize();
    // A value may pass the end of the band by as little.
    if (apart <= tolerance && (uOn == vOn || tolerance > 0)) continue;
    ++different;
    largest = std::max(largest, apart);
  }
  EXPECT_EQ(different, 0u) << what << ": of " << box.volume() << ", by up to " << largest
                           << " voxels";
}

void tryOperator(const Operator& op, const std::function<Options(Random&)>& call, unsigned seed) {
  Random random(seed);
  const double halfWidth = between(random, 3, 8);
  const Options options = call(random);
  pipeline::Invocation whole(op, options);
  for (std::size_t i = 0; i < op.operands.size(); ++i)
    whole.operands.emplace_back(someSolid(random, halfWidth));
  const std::vector<Value> operands = whole.operands;
  Value all = operands[0];
  try {
    all = op.run(whole);
  } catch (const levelset::InvalidInput&) {
    return;  // nothing is left of it
  }
  Demand of;
  if (all.kind() == pipeline::Kind::Band) {
    if (random() % 2) of.part.halfWidth = between(random, 1, halfWidth);
    if (random() % 4) {
      const Box3d bounds = all.plan().bounds;
      const V3d low = bounds.min + (bounds.size() * pointIn(random, 0.5) + bounds.size() / 2) * 0.8;
      of.part.region = Box3d(low, low + bounds.size() * between(random, 0.2, 0.6));
    }
  }
  pipeline::Invocation part(op, options);
  part.operands = operands;
  part.planned = all.plan();
  part.part = of.part;
  std::vector<Value> less;
  for (std::size_t i = 0; i < operands.size(); ++i) {
    const Demand read = op.reads(part, i, of);
    less.emplace_back(levelset::cropped(operands[i].band(), read.part));
    if (less.back().band().isEmpty()) return;  // it would be made whole
  }
  part.operands = less;
  const std::string what = op.name + " " + std::to_string(seed) + ", half width " +
                           std::to_string(of.part.halfWidth) + " of " + std::to_string(halfWidth) +
                           (levelset::isEverywhere(of.part.region) ? "" : ", in a region");
  Value made = all;
  try {
    made = op.run(part);
  } catch (const levelset::InvalidInput&) {
    return;  // as well
  }
  if (all.kind() == pipeline::Kind::Mesh) {
    EXPECT_TRUE(all.mesh().positions == made.mesh().positions) << what;
    EXPECT_TRUE(all.mesh().triangles == made.mesh().triangles) << what;
  } else {
    expectSamePart(all.band(), levelset::cropped(made.band(), of.part), of.part, op.partTolerance,
                   what);
  }
}

TEST(Demand, EveryOperatorThatReadsAPartMakesThatPartTheSame) {
  for (const Operator& op : pipeline::operators()) {
    if (!op.reads) continue;
    const auto call = kCalls.find(op.name);
    ASSERT_NE(call, kCalls.end()) << op.name << " reads parts, and no call of it is tried";
    for (unsigned seed = 0; seed < 20; ++seed) tryOperator(op, call->second, seed);
  }
}

// === Whole graphs

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream in(text);
  for (std::string word; in >> word;) {
    std::replace(word.begin(), word.end(), '_', ' ');  // within a word
    all.push_back(word);
  }
  return all;
}

class Demands : public support::ShellTest {
 protected:
  /// @return what the step of that number made, and what was needed of it
  pipeline::RunReport run(const std::string& chain, bool whole) {
    pipeline::RunReport report;
    const auto silent = [](const std::string&) {};
    pipeline::run(pipeline::parseChain(words(chain)),
                  {.wholeValues = whole, .print = silent, .warn = silent, .note = silent}, report);
    return report;
  }
  std::string path(const char* name) { return (folder_ / name).string(); }

  /// Runs the chain both ways. @return what was run with parts
  /// @param tolerance  of values, voxels; 0: the same bytes
  pipeline::RunReport expectSame(const std::string& chain, const char* extension,
                                 double tolerance = 0) {
    const std::string part = path("part") + extension, whole = path("whole") + extension;
    std::string failure, wholeFailure;
    const auto attempt = [&](const std::string& file, bool isWhole, std::string& error) {
      try {
        return run(chain + " ! write " + file, isWhole);
      } catch (const levelset::Error& refusal) {
        error = refusal.what();
        return pipeline::RunReport{};
      }
    };
    attempt(whole, true, wholeFailure);
    pipeline::RunReport report = attempt(part, false, failure);
    EXPECT_EQ(failure, wholeFailure) << chain;
    if (failure.empty() && tolerance > 0) {
      expectSamePart(levelset::readBand(whole), levelset::readBand(part), {}, tolerance, chain);
    } else if (failure.empty()) {
      EXPECT_TRUE(support::slurp(part) == support::slurp(whole)) << chain;
    }
    return report;
  }
};

TEST_F(Demands, OffsetAndClipAskForTheBoxAndTheBandThatTheyRead) {
  const pipeline::RunReport report = expectSame(
      "sphere --radius 2 --voxel 0.05 --half-width 20 ! offset 0.5 ! clip --box "
      "1.5,-0.5,-0.5_3,0.5,0.5 ! mesh",
      ".ply");
  ASSERT_EQ(report.steps.size(), 5u);
  EXPECT_EQ(report.steps[0].halfWidth, 6);
  EXPECT_EQ(report.steps[1].halfWidth, 1.5);
  EXPECT_EQ(report.steps[1].needed.region,
            Box3d(V3d(1.5, -0.5, -0.5) - V3d(3.5 * 0.05), V3d(3, 0.5, 0.5) + V3d(3.5 * 0.05)));
  EXPECT_TRUE(report.steps[3].needed.isAll());
  const pipeline::RunReport whole = run("sphere --radius 2 --voxel 0.05 --half-width 20", true);
  EXPECT_LT(report.steps[0].activeVoxels, 0.3 * whole.steps[0].activeVoxels);
  (void)report;
}

TEST_F(Demands, WhatShowsNoSurfaceInTheBoxIsMadeWhole) {
  // The box lies within the ball: of that no surface is needed, but its inside is.
  expectSame("sphere --radius 2 --voxel 0.1 ! clip --box -0.5,-0.5,-0.5_0.5,0.5,0.5 ! mesh",
             ".ply");
  expectSame("sphere --radius 2 --voxel 0.1 ! offset 0.3 ! clip --box -1,-1,-1_1,1,1 ! mesh",
             ".ply");
  expectSame("sphere --radius 2 --voxel 0.1 ! clip --box 5,5,5_6,6,6 ! mesh", ".ply");
}

TEST_F(Demands, GraphsOfAnyShapeGiveTheSameFiles) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    Random random(seed);
    std::string chain;
    int made = 0;
    const auto leaf = [&] {
      const std::string end = " --voxel 0.1 --half-width " + std::to_string(between(random, 3, 9)) +
                              " --as v" + std::to_string(made++) + " ! ";
      if (random() % 2)
        return "sphere --radius " + std::to_string(between(random, 0.8, 2)) + " --center " +
               text(pointIn(random, 1)) + end;
      return "box --size " + text(V3d(1.5) + pointIn(random, 1)) + " --center " +
             text(pointIn(random, 1)) + end;
    };
    const auto any = [&] { return " @v" + std::to_string(random() % static_cast<unsigned>(made)); };
    chain += leaf() + leaf() + leaf();
    for (int i = 0; i < 4; ++i) {
      const char* const ops[] = {"union", "difference", "intersection", "transform", "offset"};
      const std::string op = ops[random() % (seed % 2 ? 5 : 4)];  // every other one to the bit
      std::string step = op;
      if (op == "offset")
        step += " " + std::to_string(between(random, -0.2, 0.6)) + any();
      else if (op == "transform")
        step += any() + " --translate " + text(V3d(0.1) * static_cast<double>(random() % 5));
      else
        step += any() + any();
      chain += step + " --as v" + std::to_string(made++) + " ! ";
    }
    const V3d low = pointIn(random, 1);
    const Box3d box(low, low + V3d(1.1, 0.9, 1.3));
    const bool hasOffset = chain.find("offset") != std::string::npos;
    chain += "clip @v" + std::to_string(made - 1) + " --box " + text(box.min) + "_" + text(box.max);
    if (hasOffset)
      expectSame(chain, ".vdb", 1e-5);
    else if (random() % 2)
      expectSame(chain + " ! mesh", ".ply");
    else
      expectSame(chain, ".vdb");
  }
}

}  // namespace demand_test
