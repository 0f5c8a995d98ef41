#include "levelset/deform/lattice_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "levelset/error.h"
#include "tests/support/files.h"

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
  EXPECT_THROW((void)readLattice("no-such-file.json"), IoError);
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
