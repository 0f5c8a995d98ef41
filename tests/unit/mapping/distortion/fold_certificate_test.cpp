#include "mapping/distortion/fold_certificate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/fields/grid.h"
#include "levelset/rbf/rbf_taylor.h"
#include "levelset/shapes/shapes.h"
#include "mapping/distortion/distortion.h"
#include "mapping/distortion/jacobian_field.h"
#include "mapping/layers/trilinear_volume.h"
#include "mapping/maps/layer_map.h"
#include "mapping/maps/prism_map.h"
#include "mapping/placement/make_patch.h"
#include "mapping/rbf/rbf_map.h"
#include "mapping/textures/geometric_texture.h"
#include "mapping/textures/mesh_texture.h"
#include "mapping/untangle/prism_cells.h"
#include "tests/support/component_counts.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace fold_certificate_test {

using Imath::V3d;
using mapping::certifyLayers;
using mapping::certifyPrisms;
using mapping::certifyRbf;
using mapping::FoldCertificate;
using mapping::FoldVerdict;
using mapping::Patch;
using mapping::PrismMap;
using support::patchAt;

constexpr double kEps = std::numeric_limits<double>::epsilon();

V3d box(const V3d& t) {
  return t;
}

std::array<V3d, 8> unitCube() {
  std::array<V3d, 8> corners;
  for (std::size_t n = 0; n < 8; ++n)
    corners[n] = V3d(static_cast<double>(n & 1), static_cast<double>(n >> 1 & 1),
                     static_cast<double>(n >> 2));
  return corners;
}

FoldCertificate shellOf(const Patch& patch, double sink = 0) {
  return certifyPrisms(PrismMap(patch, {.embedDepth = sink}), patch.mirrored);
}

FoldCertificate rbfOf(const Patch& patch, double sink = 0) {
  return certifyRbf(mapping::patchToTexture(patch), patch, sink);
}

TEST(TrilinearVolume, FindsFoldsBetweenCorners) {
  // Compares cubes with random corners with a dense grid of samples. Some fold between their
  // corners only.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-0.75, 0.75);
  int folded = 0, hidden = 0;
  for (int trial = 0; trial < 150; ++trial) {
    std::array<V3d, 8> corners = unitCube();
    for (V3d& c : corners) c += V3d(unit(random), unit(random), unit(random));
    const auto determinantAt = [&](const V3d& t) {
      std::array<V3d, 3> slopes = {V3d(0), V3d(0), V3d(0)};
      for (std::size_t n = 0; n < 8; ++n)
        for (int axis = 0; axis < 3; ++axis) {
          double weight = n >> axis & 1 ? 1 : -1;
          for (int other = 0; other < 3; ++other)
            if (other != axis) weight *= n >> other & 1 ? t[other] : 1 - t[other];
          slopes[static_cast<std::size_t>(axis)] += corners[n] * weight;
        }
      return slopes[0].dot(slopes[1].cross(slopes[2]));
    };
    double least = HUGE_VAL, leastCorner = HUGE_VAL, negative = 0;
    constexpr int kSteps = 12;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j)
        for (int k = 0; k <= kSteps; ++k) {
          const double value = determinantAt(V3d(i, j, k) / kSteps);
          least = std::min(least, value);
          negative += value < 0;
          if (i % kSteps == 0 && j % kSteps == 0 && k % kSteps == 0)
            leastCorner = std::min(leastCorner, value);
        }
    const mapping::VolumeSign sign = mapping::signOfTrilinear(corners, 0, 1, 4096);
    if (least < -1e-3) {
      ++folded;
      hidden += leastCorner > 0;
      EXPECT_TRUE(sign.folds) << trial;
      EXPECT_LE(sign.least, 0.5 * least) << trial;
      EXPECT_NEAR(sign.negative + sign.undecided / 2, negative / std::pow(kSteps + 1, 3),
                  support::measured(0.0425));
    } else if (least > 1e-3) {
      EXPECT_FALSE(sign.folds) << trial;
      EXPECT_EQ(sign.negative, 0) << trial;
      EXPECT_EQ(sign.undecided, 0) << trial;
    }
    EXPECT_NEAR(determinantAt(sign.at), sign.least, support::doubleRounding(2));
  }
  EXPECT_GT(folded, 15);
  EXPECT_LT(folded, 135);
  EXPECT_GT(hidden, 0);
}

TEST(TrilinearVolume, DetectsAFlatCubeAsFolded) {
  std::array<V3d, 8> corners = unitCube();
  for (V3d& c : corners) c.z = 0;
  EXPECT_TRUE(mapping::signOfTrilinear(corners, 0, 1).folds);
  corners = unitCube();
  EXPECT_FALSE(mapping::signOfTrilinear(corners, 0, 1).folds);
  EXPECT_TRUE(mapping::signOfTrilinear(corners, 0, -1).folds);
  // Corners with an uncertainty above the cube's thickness prove nothing.
  for (V3d& c : corners) c.z *= 1e-3;
  EXPECT_FALSE(mapping::signOfTrilinear(corners, 1e-6, 1).folds);
  EXPECT_TRUE(mapping::signOfTrilinear(corners, 1e-3, 1).folds);
}

TEST(FoldCertificate, TetrahedraAreDecidedExactly) {
  // A particle crosses the opposite face. The result does not depend on how far.
  Patch patch = patchAt(box, 3, 3, 3);
  V3d& p = patch.layers[1].positions[4];
  p = V3d(0.5, 0.5, 0);
  for (const double way : {2 * kEps, -2 * kEps}) {
    p.z = way;
    const FoldCertificate certificate = shellOf(patch);
    EXPECT_EQ(certificate.verdict() == FoldVerdict::Certified, way > 0) << way;
    EXPECT_EQ(certificate.undecidedShare, 0);
  }
  p.z = 0;
  EXPECT_EQ(shellOf(patch).verdict(), FoldVerdict::Folds);
}

TEST(FoldCertificate, CertifiesBoxesAndGentlyBentPatches) {
  const auto bent = [](const V3d& t) {
    const double angle = 2 * (t.x - 0.5), r = 2 + t.z;
    return V3d(r * std::sin(angle), 3 * t.y, r * std::cos(angle));
  };
  for (const auto& place : {+[](const V3d& t) { return t; }, +bent}) {
    const Patch patch = patchAt(place, 9, 7, 4);
    for (const double sink : {0.0, 0.1, -0.1}) {
      for (const FoldCertificate& certificate :
           {shellOf(patch, sink), certifyLayers(patch, sink), rbfOf(patch, sink)}) {
        EXPECT_EQ(certificate.verdict(), FoldVerdict::Certified);
        EXPECT_EQ(certificate.undecidedShare, 0);
        EXPECT_EQ(certificate.foldedShare, 0);
        EXPECT_GT(certificate.leastJacobian, 0.5);
        EXPECT_LE(certificate.leastJacobian, 1 + 1e-9);
      }
    }
  }
}

TEST(FoldCertificate, LeastJacobianOfACylinderMatchesItsFormula) {
  // Volumes are proportional to the radius, from 2 to 3. The ends of the chords are at 2 · sin(α) /
  // α.
  const auto bent = [](const V3d& t) {
    const double angle = 2 * (t.x - 0.5), r = 2 + t.z;
    return V3d(r * std::sin(angle), 3 * t.y, r * std::cos(angle));
  };
  const Patch patch = patchAt(bent, 65, 5, 33);
  EXPECT_NEAR(certifyLayers(patch, 0).leastJacobian, 2 / 2.5, support::measured(0.00497));
  EXPECT_NEAR(shellOf(patch).leastJacobian, 2 / 2.5, support::measured(0.00497));
}

TEST(FoldCertificate, ReportsThePositionOfAFold) {
  // One corner of a cell is moved through the cell.
  const auto pushed = [](double way) {
    Patch patch = patchAt([](const V3d& t) { return V3d(4 * t.x, 4 * t.y, t.z); }, 9, 9, 3);
    patch.layers[1].positions[4 * 9 + 4] += V3d(way, way, 0);
    return patch;
  };
  for (const FoldCertificate& certificate : {shellOf(pushed(0.8)), certifyLayers(pushed(0.8), 0)}) {
    ASSERT_EQ(certificate.verdict(), FoldVerdict::Folds);
    ASSERT_FALSE(certificate.worst.empty());
    EXPECT_LE(certificate.worst.size(), FoldCertificate::kMostPoints);
    EXPECT_LE((certificate.worst[0].uvw - V3d(0.5)).length(), support::measured(0.254));
    EXPECT_LE((certificate.worst[0].position - V3d(2, 2, 0.5)).length(),
              support::measured(1.13, 1.3));
    EXPECT_DOUBLE_EQ(certificate.worst[0].jacobian, certificate.leastJacobian);
    EXPECT_LT(certificate.leastJacobian, 0);
    EXPECT_GT(certificate.foldedShare, 0);
    EXPECT_LT(certificate.foldedShare, support::measured(0.0104));
  }
  for (const FoldCertificate& certificate : {shellOf(pushed(0.2)), certifyLayers(pushed(0.2), 0)})
    EXPECT_EQ(certificate.verdict(), FoldVerdict::Certified);
}

TEST(FoldCertificate, VerdictsOnSmoothMapsMatchTheirDerivatives) {
  // Where the certificate proves the absence of folds, no sample folds. Where it finds a fold, the
  // Jacobian at the reported position is negative.
  int certified = 0, folded = 0;
  for (const double way : {0.0, 0.1, 0.25, 0.6, 1.2}) {
    Patch patch = patchAt([](const V3d& t) { return V3d(2 * t.x, 2 * t.y, t.z); }, 6, 6, 4);
    for (std::size_t k = 1; k < 4; ++k) {
      V3d& p = patch.layers[k].positions[2 * 6 + 3];
      p += V3d(way, 0.7 * way, 0);
    }
    const mapping::RbfMap map = mapping::patchToTexture(patch, {.lambdaFar = 0.005});
    const FoldCertificate certificate = certifyRbf(map, patch, 0);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    double least = HUGE_VAL;
    for (int n = 0; n < 4000; ++n) {
      const V3d x(2 * unit(random), 2 * unit(random), unit(random)), uvw = map(x);
      if (std::min({uvw.x, uvw.y, uvw.z}) < 0 || std::max({uvw.x, uvw.y, uvw.z}) > 1) continue;
      least = std::min(least, map.jacobian(x).determinant());
    }
    if (certificate.verdict() == FoldVerdict::Certified) {
      ++certified;
      EXPECT_GT(least, 0) << way;
    }
    if (certificate.verdict() == FoldVerdict::Folds) {
      ++folded;
      for (const mapping::FoldPoint& fold : certificate.worst) {
        EXPECT_LE((map(fold.position) - fold.uvw).length(), support::rounding(0.8));
        EXPECT_LE(map.jacobian(fold.position).determinant(), 0);
        EXPECT_NEAR(map.jacobian(fold.position).determinant() / certificate.unit, fold.jacobian,
                    support::doubleRounding(3));
      }
    }
    if (least < 0) {
      EXPECT_NE(certificate.verdict(), FoldVerdict::Certified) << way;
    }
  }
  EXPECT_GE(certified, 2);
  EXPECT_GE(folded, 1);
}

TEST(FoldCertificate, FoldsBetweenSamplesAreRefused) {
  // Moves the corners of one cell at random until it folds between the samples.
  levelset::TriMesh triangle;
  triangle.positions = {V3d(0.1, 0.1, 0.1), V3d(0.9, 0.1, 0.5), V3d(0.1, 0.9, 0.9)};
  triangle.triangles = {{0, 1, 2}};
  const Imath::Box3d whole(V3d(0), V3d(1));
  std::mt19937 random(17);
  std::uniform_real_distribution<double> unit(-0.6, 0.6);
  int missed = 0;
  for (int trial = 0; trial < 2000 && missed < 3; ++trial) {
    const Patch patch = patchAt(
        [&](const V3d& t) { return t + V3d(unit(random), unit(random), unit(random)); }, 2, 2, 2);
    const std::vector<mapping::MapSample> samples = mapping::sampleLayerMap(patch, 0);
    if (mapping::surveyDistortion(samples, V3d(1)).folded > 0) continue;
    if (certifyLayers(patch, 0).verdict() != FoldVerdict::Folds) continue;
    ++missed;
    try {
      (void)mapping::mapMesh(triangle, patch, {.textureBox = whole});
      ADD_FAILURE() << "a fold was accepted";
    } catch (const levelset::InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find("folds between the"), std::string::npos)
          << error.what();
    }
    const auto allowed =
        mapping::mapMesh(triangle, patch, {.textureBox = whole, .allowFolds = true});
    EXPECT_EQ(allowed.certificate.verdict(), FoldVerdict::Folds);
    EXPECT_FALSE(allowed.notes.empty());
  }
  EXPECT_GT(missed, 0);
}

TEST(FoldCertificate, LayersWithDifferentCountsAreSplitAtTheBordersOfBoth) {
  Patch patch = patchAt(box, 5, 4, 3);
  patch.layers[1] = patchAt(box, 4, 6, 3).layers[1];
  const mapping::PrismCells cells(patch, 0.1);
  double volume = 0;
  const std::vector<V3d> positions = mapping::particlePositions(patch);
  for (std::size_t n = 0; n < cells.size(); ++n) {
    const mapping::PrismCell cell = cells.at(n);
    const V3d sides = cell.box.size();
    volume += sides.x * sides.y * sides.z;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const V3d uvw(corner & 1 ? cell.box.max.x : cell.box.min.x,
                    corner & 2 ? cell.box.max.y : cell.box.min.y,
                    corner & 4 ? cell.box.max.z : cell.box.min.z);
      const V3d place = mapping::positionOf(cell.corners[corner], positions);
      EXPECT_LE((place - mapping::layerPosition(patch, uvw)).length(), support::doubleRounding(2));
      EXPECT_LE((place - uvw).length(), support::doubleRounding(2));
    }
  }
  EXPECT_NEAR(volume, 1.1, support::doubleRounding(3));
  EXPECT_EQ(certifyLayers(patch, 0.1).verdict(), FoldVerdict::Certified);
}

TEST(FoldCertificate, MirroredPatchesAreNotFolded) {
  Patch patch = patchAt([](const V3d& t) { return V3d(1 - t.x, t.y, t.z); }, 4, 4, 3);
  for (const FoldCertificate& certificate :
       {shellOf(patch), certifyLayers(patch, 0), rbfOf(patch)}) {
    EXPECT_EQ(certificate.verdict(), FoldVerdict::Folds);
    EXPECT_NEAR(certificate.foldedShare, 1, support::doubleRounding(4));
  }
  patch.mirrored = true;
  for (const FoldCertificate& certificate :
       {shellOf(patch), certifyLayers(patch, 0), rbfOf(patch)}) {
    EXPECT_EQ(certificate.verdict(), FoldVerdict::Certified);
    EXPECT_NEAR(certificate.leastJacobian, 1, support::doubleRounding(10));
  }
}

TEST(FoldCertificate, HandlesTheSmallestPatchAndOneWithoutVolume) {
  const Patch smallest = patchAt(box, 2, 2, 2);
  EXPECT_EQ(certifyLayers(smallest, 0).verdict(), FoldVerdict::Certified);
  EXPECT_EQ(shellOf(smallest).verdict(), FoldVerdict::Certified);
  EXPECT_EQ(rbfOf(smallest).verdict(), FoldVerdict::Certified);
  const Patch flat = patchAt([](const V3d& t) { return V3d(t.x, t.y, 0); }, 4, 4, 3);
  for (const FoldCertificate& certificate : {shellOf(flat), certifyLayers(flat, 0)}) {
    EXPECT_EQ(certificate.verdict(), FoldVerdict::Folds);
    EXPECT_NEAR(certificate.foldedShare, 1, support::doubleRounding(4));
    EXPECT_EQ(certificate.leastJacobian, 0);
  }
}

TEST(FoldCertificate, DoesNotDependOnPositionScaleOrThreads) {
  const auto wavy = [](const V3d& t) {
    return V3d(t.x + 0.1 * std::sin(3 * t.y), t.y, t.z * (1 + 0.3 * t.x * t.y));
  };
  const Patch patch = patchAt(wavy, 7, 6, 4);
  const FoldCertificate layers = certifyLayers(patch, 0.05), rbf = rbfOf(patch, 0.05);
  for (const double scale : {1e-6, 1e6}) {
    const auto scaled = [&](const V3d& t) { return wavy(t) * scale + V3d(1e3 * scale); };
    const Patch moved = patchAt(scaled, 7, 6, 4, scale);
    EXPECT_EQ(certifyLayers(moved, 0.05).verdict(), FoldVerdict::Certified);
    EXPECT_NEAR(certifyLayers(moved, 0.05).leastJacobian, layers.leastJacobian,
                support::measured(8.83e-13));
    EXPECT_EQ(shellOf(moved).verdict(), FoldVerdict::Certified);
    EXPECT_EQ(rbfOf(moved, 0.05).verdict(), rbf.verdict());
  }
  for (const std::size_t threads : {1u, 3u}) {
    const FoldCertificate again = support::onThreads(threads, [&] { return rbfOf(patch, 0.05); });
    EXPECT_EQ(again.leastJacobian, rbf.leastJacobian);
    EXPECT_EQ(again.pieces, rbf.pieces);
    EXPECT_EQ(again.undecidedShare, rbf.undecidedShare);
  }
}

TEST(RbfTaylor, PolynomialsOfDistancesHaveTheStatedOrder) {
  // At half the distance the error of the value falls to a sixty-fourth, because the next term has
  // degree six.
  const V3d way(1.5, -2, 0.5), weight(1, -0.5, 2), direction(0.3, 0.4, -0.2);
  levelset::rbf::TaylorPolynomial polynomial;
  polynomial.addDistance(way, weight);
  double last = 0;
  for (const double step : {0.25, 0.125, 0.0625}) {
    const V3d s = direction * step;
    const V3d exact = weight * (way + s).length();
    const double error = (polynomial.value(s) - exact).length();
    if (last > 0) {
      EXPECT_NEAR(std::log2(last / error), 6, support::measured(0.123));
    }
    last = error;
    levelset::rbf::TaylorPolynomial shifted = polynomial;
    shifted.shift(V3d(0.1, -0.2, 0.3));
    EXPECT_LE((shifted.value(s - V3d(0.1, -0.2, 0.3)) - polynomial.value(s)).length(),
              support::doubleRounding(8));
    const Imath::M33d slopes = polynomial.slopes(s);
    for (int axis = 0; axis < 3; ++axis) {
      V3d ahead = s, behind = s;
      ahead[axis] += 1e-4, behind[axis] -= 1e-4;
      const V3d difference = (polynomial.value(ahead) - polynomial.value(behind)) / 2e-4;
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(slopes[k][axis], difference[k], support::measured(6.07e-10));
    }
  }
}

TEST(RbfTaylor, CubesSatisfyTheirBounds) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto wavy = [](const V3d& t) {
    return V3d(3 * t.x + 0.3 * std::sin(5 * t.y), 3 * t.y, t.z + 0.2 * std::cos(4 * t.x));
  };
  const Patch patch = patchAt(wavy, 12, 12, 4);
  const mapping::RbfMap map = mapping::patchToTexture(patch);
  const V3d sizes = mapping::meanExtents(patch);
  const levelset::rbf::RbfCubes cubes(map.function(), sizes, 1e-2);
  levelset::rbf::RbfCube cube = cubes.root(V3d(0), 2);
  bool hasFar = false;
  for (int layer = 0; layer < 6; ++layer) {
    for (int n = 0; n < 20; ++n) {
      const V3d s =
          V3d(2 * unit(random) - 1, 2 * unit(random) - 1, 2 * unit(random) - 1) * cube.half;
      const V3d place = cube.center + s;
      const V3d value = map(place + map.function().origin()) * sizes;
      EXPECT_LE((cubes.value(cube, place) - value).length(), cube.valueError + 1e-12);
      const Imath::M33d exact = map.jacobian(place + map.function().origin()),
                        found = cubes.slopes(cube, place);
      double squares = 0;
      for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis)
          squares += std::pow(exact[k][axis] * sizes[k] - found[k][axis], 2);
      EXPECT_LE(std::sqrt(squares), cube.slopeError + 1e-12);
    }
    hasFar = hasFar || cube.near.size() < map.size();
    EXPECT_LE(cube.slopeError, support::measured(0.00153));
    cube = cubes.octant(cube, layer % 8);
  }
  EXPECT_TRUE(hasFar);
}

TEST(RbfTaylor, EvaluatesManyPositionsLikeTheMap) {
  const Patch patch =
      patchAt([](const V3d& t) { return V3d(3 * t.x, 3 * t.y, t.z + 0.3 * t.x * t.x); }, 14, 14, 4);
  const mapping::RbfMap map = mapping::patchToTexture(patch);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<mapping::MapSample> samples(500);
  for (auto& sample : samples)
    sample.position = V3d(3 * unit(random), 3 * unit(random), unit(random));
  mapping::evaluateRbf(map, patch, samples);
  for (const auto& sample : samples) {
    EXPECT_LE((sample.uvw - map(sample.position)).length(), support::measured(5.01e-10));
    const Imath::M33d exact = map.jacobian(sample.position);
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(sample.jacobian[k][axis], exact[k][axis], support::rounding(0.2));
  }
}

TEST(JacobianField, HasTheJacobianOfEachMap) {
  // Heights increase with x. The Jacobian of texture → patch is (1 + x) / 1.5, with median 1.
  const auto wedge = [](const V3d& t) { return V3d(t.x, t.y, t.z * (1 + t.x)); };
  const Patch patch = patchAt(wedge, 17, 5, 3);
  const mapping::JacobianFieldOptions options{.voxelSize = 0.05};
  const FoldCertificate layers = certifyLayers(patch, 0);
  const auto field = levelset::asScalarField(mapping::jacobianField(patch, layers, options));
  const PrismMap shell(patch, {});
  const auto straight = levelset::asScalarField(
      mapping::jacobianField(patch, shell, certifyPrisms(shell, false), options));
  const mapping::RbfMap map = mapping::patchToTexture(patch);
  const FoldCertificate proof = certifyRbf(map, patch, 0);
  const auto smooth = levelset::asScalarField(mapping::jacobianField(patch, map, proof, options));
  // For patch → texture, half of the volume is below x = √2.5 − 1.
  EXPECT_NEAR(proof.unit, 1 / std::sqrt(2.5), support::measured(0.00866));
  for (const double x : {0.25, 0.5, 0.75}) {
    const V3d place(x, 0.5, 0.5);
    EXPECT_NEAR(field(place), (1 + x) / 1.5, support::measured(0.0238, 0.03)) << x;
    EXPECT_NEAR(straight(place), (1 + x) / 1.5, support::measured(0.0238)) << x;
    EXPECT_NEAR(smooth(place), map.jacobian(place).determinant() / proof.unit, support::rounding(3))
        << x;
  }
  EXPECT_EQ(field(V3d(0.5, 0.5, 3)), 1);
  EXPECT_THROW((void)mapping::jacobianField(patch, layers, {}), levelset::UsageError);
  EXPECT_THROW((void)mapping::jacobianField(patch, layers, {.voxelSize = 1e-12}),
               levelset::ResourceLimit);
}

TEST(FoldCertificate, OfASmoothMapShowsEveryCountedFold) {
  // The patch is higher than the trough is wide. Folded cubes also lie across the border of the
  // texture.
  const levelset::NarrowBand trough =
      levelset::subtract(levelset::makeBox(V3d(8, 8, 2), V3d(0, 0, -1), 0.2),
                         levelset::makeCylinder(1.5, 12, V3d(0), V3d(0, 1, 0), 0.2));
  const std::array<V3d, 4> corners = {V3d(-1, -1, -1.12), V3d(1, -1, -1.12), V3d(1, 1, -1.12),
                                      V3d(-1, 1, -1.12)};
  const Patch patch = mapping::makePatch(trough, corners, 2.5, {.layers = 4}).patch;
  const FoldCertificate proof = certifyRbf(mapping::patchToTexture(patch), patch, 0.1);
  // Every counted fold has a visible position. A possible fold outside is not certified.
  EXPECT_EQ(proof.foldedShare > 0, proof.verdict() == FoldVerdict::Folds);
  EXPECT_EQ(proof.leastJacobian <= 0, proof.verdict() == FoldVerdict::Folds);
  EXPECT_NE(proof.verdict(), FoldVerdict::Certified);
  EXPECT_GT(proof.foldedShare + proof.undecidedShare, 0);
}

TEST(JacobianField, ShowsFoldsBetweenGridPoints) {
  Patch patch = patchAt(box, 9, 9, 3);
  patch.layers[1].positions[4 * 9 + 4] += V3d(0.2, 0.2, 0);
  const FoldCertificate certificate = certifyLayers(patch, 0);
  ASSERT_EQ(certificate.verdict(), FoldVerdict::Folds);
  const levelset::FieldGrid field = mapping::jacobianField(patch, certificate, {.voxelSize = 0.5});
  const auto value = levelset::asScalarField(field);
  const V3d place = certificate.worst[0].position;
  const V3d point(std::round(place.x / 0.5) * 0.5, std::round(place.y / 0.5) * 0.5,
                  std::round(place.z / 0.5) * 0.5);
  EXPECT_LT(value(point), 0);
}

}  // namespace fold_certificate_test
