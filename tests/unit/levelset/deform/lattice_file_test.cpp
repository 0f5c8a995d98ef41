#include "levelset/deform/lattice_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <random>

#include "levelset/deform/deform_band.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"

namespace lattice_file_test {

using namespace levelset;
using Imath::V3d;

ControlLattice someLattice() {
  LatticeData data = identityLattice({uniformAxis(2, 4), uniformAxis(1, 2), uniformAxis(3, 4)},
                                     frameOf({V3d(0, 0, 0), V3d(1, 2, 3)}))
                         .data();
  data.boxToWorld[0][1] = 0.25;  // a skew box
  for (std::size_t n = 0; n < data.points.size(); ++n) {
    data.points[n] += V3d(0.1, 1 / 3.0, -0.7) * static_cast<double>(n);
    data.weights.push_back(1 + 0.01 * static_cast<double>(n));
  }
  return ControlLattice(std::move(data));
}

TEST(LatticeFile, KeepsEveryBit) {
  const support::TemporaryFolder folder;
  const ControlLattice lattice = someLattice();
  writeLattice(folder.path() / "a.json", lattice);
  const ControlLattice read = readLattice(folder.path() / "a.json");
  EXPECT_EQ(read.data().axes, lattice.data().axes);
  EXPECT_EQ(read.data().boxToWorld, lattice.data().boxToWorld);
  EXPECT_EQ(read.data().points, lattice.data().points);
  EXPECT_EQ(read.data().weights, lattice.data().weights);
}

TEST(LatticeFile, ReadsAShortForm) {
  const ControlLattice lattice = parseLattice(
      R"({"format": "levelsmith lattice", "version": 1, "degree": [1, 1, 1], "count": [2, 2, 2],
          "min": [0, 0, 0], "max": [1, 1, 2],
          "points": [[0,0,0],[0,0,2],[0,1,0],[0,1,2],[1,0,0],[1,0,2],[1,1,0],[1,1,2]]})",
      "short");
  EXPECT_TRUE(lattice.isIdentity());
}

TEST(LatticeFile, RefusalsNameFileAndMember) {
  const std::string good =
      R"({"format": "levelsmith lattice", "version": 1, "degree": [1, 1, 1], "count": [2, 2, 2],
          "min": [0, 0, 0], "max": [1, 1, 2],
          "points": [[0,0,0],[0,0,2],[0,1,0],[0,1,2],[1,0,0],[1,0,2],[1,1,0],[1,1,2]]})";
  const auto refusal = [&](const std::string& from, const std::string& to) -> std::string {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    try {
      (void)parseLattice(text, "a.json");
    } catch (const InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  const auto expect = [&](const std::string& from, const std::string& to, const std::string& part) {
    const std::string sentence = refusal(from, to);
    EXPECT_NE(sentence.find(part), std::string::npos) << sentence;
    EXPECT_EQ(sentence.find("a.json: "), 0u) << sentence;
  };
  expect("levelsmith lattice", "levelsmith patches", "is not a lattice file");
  expect("\"version\": 1", "\"version\": 2", "version 1");
  expect("[1, 1, 1]", "[0, 1, 1]", "degree of the lattice is 0");
  expect("[1, 1, 1]", "[1, 21, 1]", "degree of the lattice is 21");
  expect("[1, 1, 1]", "[1, 1.5, 1]", "degree of the lattice is 1.5");
  expect("[2, 2, 2]", "[2, 2, 3]", "8 control points, but its");
  expect("[2, 2, 2]", "[2, 2, 1e9]", "in \"count\"");
  expect("[2, 2, 2]", "[2, 2, 1e7]", "needs 40000000");
  expect("[0,1,2]", "[0,1]", "point 3 without three numbers");
  expect("[0,1,2]", "[0,1,null]", "point 3 that is not a finite number");
  expect("[1, 1, 2]", "[1, 0, 2]", "empty or flat");
  expect("\"points\"", "\"weights\": [1, -1, 1, 1, 1, 1, 1, 1], \"points\"", "weight 1");
  expect("\"points\"", "\"knots\": [[0,0,1,1]], \"points\"", "not three lists");
  expect("]]}", "]]", "truncated");
  expect("[0,1,2]", "[0,NaN,2]", "a number that is not finite");
  expect("[0,1,2]", "[0,Infinity,2]", "a number that is not finite");
  expect("[0,1,2]", "[0,1e999,2]", "a number that is not finite");
  expect("[0,1,2]", "[0,-1e999,2]", "a number that is not finite");
  expect("[0,1,2]", "[0,\"1\",2]", "point 3 that is not a finite number");
  expect("[0,1,2]", "{\"x\": 0}", "point 3 that is not a list");
  expect("[1, 1, 1]", "[-1, 1, 1]", "degree of the lattice is -1");
  expect("[1, 1, 1]", "[1e300, 1, 1]", "degree of the lattice is 1e+300");
  expect("[1, 1, 1]", "1", "\"degree\" that is not a list");
  expect("[2, 2, 2]", "[0, 2, 2]", "has 0 in \"count\"");
  expect("[2, 2, 2]", "[-8, -1, 1]", "has -8 in \"count\"");
  // Their products overflow 32 and 64 bits.
  expect("[2, 2, 2]", "[65536, 65536, 2]", "needs 8589934592");
  expect("[2, 2, 2]", "[9999999, 9999999, 9999999]", "8 control points, but its");
  expect("[2, 2, 2]", "[2, 2, 18446744073709551618]", "in \"count\"");
  expect("\"points\"", "\"degree\": [2, 1, 1], \"points\"", "lists \"degree\" twice");
  expect("\"points\": [", "\"points\": [], \"points\": [", "lists \"points\" twice");
  expect("\"points\"", "\"weights\": [1], \"points\"", "weights");
  expect("\"points\"", "\"weights\": {}, \"points\"", "weights");
  EXPECT_THROW((void)readLattice("no-such-file.json"), IoError);
}

/// Mutated files are refused with a sentence, or are lattices. They deform a ball, or the
/// deformation is refused with a sentence, in the memory that it may use.
TEST(LatticeFile, TwoHundredMutatedFilesAreRefusedOrDeformABall) {
  const NarrowBand ball = makeSphere(0.4, V3d(0.5, 1, 1.5), 0.1);
  LatticeData data = identityLattice({uniformAxis(2, 4), uniformAxis(1, 2), uniformAxis(3, 4)},
                                     frameOf({V3d(-0.5, 0, 0), V3d(1.5, 2, 3)}))
                         .data();
  for (V3d& p : data.points) p += V3d(0.1 * p.y, 1 / 30.0 * p.z * p.z, 0);
  data.weights.assign(data.points.size(), 0.75);
  const support::TemporaryFolder folder;
  writeLattice(folder.path() / "a.json", ControlLattice(std::move(data)));
  const std::string good = support::readText(folder.path() / "a.json");
  std::mt19937 random(3);
  int refused = 0, notDeformed = 0, deformed = 0;
  for (int n = 0; n < 200; ++n) {
    const std::string text = support::mutated(good, random);
    SCOPED_TRACE(n);
    std::optional<ControlLattice> lattice;
    try {
      lattice = parseLattice(text, "mutant");
    } catch (const InvalidInput& error) {
      ++refused;
      EXPECT_GT(std::string(error.what()).size(), 30u);
      continue;
    }
    try {
      const NarrowBand result = deformBand(ball, *lattice, {.maxMemory = 200'000'000}).band;
      ++deformed;
      EXPECT_TRUE(std::isfinite(measure(result).volume));
      EXPECT_GT(measure(result).volume, 0);
    } catch (const Error& error) {
      ++notDeformed;
      EXPECT_GT(std::string(error.what()).size(), 30u);
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(deformed, 10);
  EXPECT_EQ(refused + notDeformed + deformed, 200);
}

/// 47³ control points of degree 3.
TEST(LatticeFile, ReadsAHundredThousandControlPoints) {
  const LatticeAxis axis = uniformAxis(3, 47);
  LatticeData data = identityLattice({axis, axis, axis}, frameOf({V3d(-2), V3d(2)})).data();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> shift(-0.01, 0.01);
  for (V3d& p : data.points) p += V3d(shift(random), shift(random), shift(random));
  const support::TemporaryFolder folder;
  writeLattice(folder.path() / "a.json", ControlLattice(data));
  const auto file = folder.path() / "a.json";
  const ControlLattice lattice = readLattice(file, std::size_t{1} << 30);
  EXPECT_EQ(lattice.data().points, data.points);
  EXPECT_THROW((void)readLattice(file, 10'000'000), ResourceLimit);
  const DeformBandResult result = deformBand(makeSphere(1, V3d(0), 0.1), lattice);
  EXPECT_TRUE(result.certificate.isInjective());
  EXPECT_EQ(result.certificate.pieces, 44u * 44 * 44);
  EXPECT_NEAR(measure(result.band).volume / (4 / 3.0 * std::numbers::pi), 1,
              support::measured(2.2e-4));
}

/// Mutated files are refused with a sentence, or are lattices.
TEST(LatticeFile, TwoHundredMutatedFilesAreRefusedOrRead) {
  const support::TemporaryFolder folder;
  writeLattice(folder.path() / "a.json", someLattice());
  const std::string good = support::readText(folder.path() / "a.json");
  std::mt19937 random(1);
  int refused = 0, read = 0;
  for (int n = 0; n < 200; ++n) {
    const std::string text = support::mutated(good, random);
    try {
      const ControlLattice lattice = parseLattice(text, "mutant");
      ++read;
      EXPECT_EQ(lattice.data().points.size(), 32u);
    } catch (const InvalidInput& error) {
      ++refused;
      EXPECT_GT(std::string(error.what()).size(), 30u);
    }
  }
  EXPECT_EQ(refused + read, 200);
  EXPECT_GT(refused, 120);
}

}  // namespace lattice_file_test
