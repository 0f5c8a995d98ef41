#include "levelset/molecules/molecule_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/molecules/ball_union.h"
#include "levelset/molecules/excluded_surface.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace molecule_surface_test {

using Imath::V3d;
using levelset::Molecule;
using levelset::moleculeSurface;
using levelset::MoleculeSurface;
using levelset::MoleculeSurfaceResult;
using support::measured;
using support::refusal;

/// A chain of atoms that folds at random, as that of a protein.
Molecule chain(int count) {
  std::mt19937 random(3);
  std::normal_distribution<double> turn;
  Molecule molecule{.residues = {{"UNK", 1, "", 0}, {"UNK", 2, "", 0}}, .chains = {"A"}};
  V3d at(0), along(1, 0, 0);
  const std::uint8_t elements[] = {6, 7, 6, 8, 16};
  for (int n = 0; n < count; ++n) {
    molecule.atoms.push_back({.position = at,
                              .name = "X",
                              .element = elements[n % 5],
                              .residue = static_cast<std::uint32_t>(2 * n / count)});
    along = (along + V3d(turn(random), turn(random), turn(random)) * 0.6 - at * 0.05).normalized();
    at += along * 1.5;
  }
  return molecule;
}

/// Largest error of the values of a band against a distance function, in voxels.
template <class Distance>
double worstError(const levelset::NarrowBand& band, const Distance& distance) {
  double worst = 0;
  support::forEachActive(band, [&](const V3d& p, double value) {
    worst = std::max(worst, std::abs(value - distance(p)) / band.voxelSize());
  });
  return worst;
}

TEST(MoleculeSurface, StoresExactDistances) {
  const Molecule molecule = chain(60);
  const double voxel = 0.3;
  for (const auto kind :
       {MoleculeSurface::VanDerWaals, MoleculeSurface::Accessible, MoleculeSurface::Excluded}) {
    std::vector<levelset::Ball> balls;
    for (const levelset::Atom& atom : molecule.atoms)
      balls.push_back({atom.position, levelset::vanDerWaalsRadius(atom.element) +
                                          (kind == MoleculeSurface::VanDerWaals ? 0 : 1.4)});
    const levelset::BallUnion all(balls, 8);
    const levelset::ExcludedSurface excluded(all, 1.4);
    const MoleculeSurfaceResult result = moleculeSurface(molecule, voxel, {.kind = kind});
    const double worst = worstError(result.band, [&](const V3d& p) {
      return kind == MoleculeSurface::Excluded ? excluded.distance(p) : all.distance(p);
    });
    EXPECT_LT(worst, support::rounding(3));
    EXPECT_GT(result.band.activeVoxelCount(), 10'000u);
  }
}

TEST(MoleculeSurface, HasTheVolumeOfTheBalls) {
  const Molecule molecule = chain(60);
  double last = 0;
  for (const double voxel : {0.4, 0.2, 0.1}) {
    const MoleculeSurfaceResult result =
        moleculeSurface(molecule, voxel, {.kind = MoleculeSurface::VanDerWaals});
    const auto found = measure(bandToMesh(result.band));
    double area = 0;
    for (const double part : result.areas) area += part;
    const double volumeError = std::abs(found.volume / result.volume - 1);
    EXPECT_LT(volumeError, measured(0.043 * voxel * voxel)) << voxel;
    EXPECT_LT(std::abs(found.area / area - 1), measured(0.109 * voxel)) << voxel;
    if (last > 0) {
      EXPECT_GT(std::log2(last / volumeError), 1.7);
    }
    last = volumeError;
  }
}

TEST(MoleculeSurface, ConvergesToTheExcludedVolume) {
  // A capsule-like solid: two atoms with a torus between them. Its profile is integrated.
  const double half = 1.5, radius = 1.7, probe = 1.4;
  Molecule molecule{.residues = {{"UNK", 1, "", 0}}, .chains = {"A"}};
  for (const double x : {-half, half})
    molecule.atoms.push_back({.position = V3d(x, 0, 0), .name = "C", .element = 6});
  const double ring = std::sqrt((radius + probe) * (radius + probe) - half * half);
  const double contact = half * probe / (radius + probe);
  double volume = 0;
  constexpr int kSteps = 200'000;
  for (int n = 0; n < kSteps; ++n) {
    const double x = (half + radius) * (n + 0.5) / kSteps;
    const double r = x < contact ? ring - std::sqrt(probe * probe - x * x)
                                 : std::sqrt(radius * radius - (x - half) * (x - half));
    volume += 2 * std::numbers::pi * r * r * (half + radius) / kSteps;
  }
  double last = 0;
  for (const double voxel : {0.2, 0.1, 0.05}) {
    const auto result = moleculeSurface(molecule, voxel);
    const double error = std::abs(measure(bandToMesh(result.band)).volume / volume - 1);
    EXPECT_LT(error, measured(0.151 * voxel * voxel)) << voxel;
    if (last > 0) {
      EXPECT_GT(std::log2(last / error), 1.7);
    }
    last = error;
  }
}

TEST(MoleculeSurface, HasTheSameBitsOnAnyNumberOfThreads) {
  const Molecule molecule = chain(100);
  const auto hash = [&] { return moleculeSurface(molecule, 0.4).band.contentHash(); };
  EXPECT_EQ(support::onThreads(1, hash), support::onThreads(7, hash));
}

TEST(MoleculeSurface, AddsTheAreasOfResidues) {
  const Molecule molecule = chain(30);
  const MoleculeSurfaceResult result = moleculeSurface(molecule, 0.5);
  const std::vector<double> sums = residueAreas(molecule, result.areas);
  double all = 0;
  for (const double area : result.areas) all += area;
  ASSERT_EQ(sums.size(), 2u);
  EXPECT_GT(sums[0], 0);
  EXPECT_NEAR(sums[0] + sums[1], all, 1e-10);
}

TEST(MoleculeSurface, DividesItsVolumeAmongTheAtoms) {
  const Molecule molecule = chain(60);
  for (const auto kind : {MoleculeSurface::VanDerWaals, MoleculeSurface::Excluded}) {
    const MoleculeSurfaceResult result =
        moleculeSurface(molecule, 0.5, {.kind = kind, .volumes = true});
    double sum = 0;
    for (const double volume : result.volumes) {
      EXPECT_GE(volume, 0);
      sum += volume;
    }
    EXPECT_NEAR(sum / result.volume, 1, 1e-10);
    const std::vector<double> residues = residueAreas(molecule, result.volumes);
    EXPECT_NEAR((residues[0] + residues[1]) / sum, 1, 1e-12);
  }
}

/// Carbon atoms on a sphere of 6 Å.
Molecule hollowMolecule() {
  Molecule molecule{.residues = {{"UNK", 1, "", 0}}, .chains = {"A"}};
  constexpr int kCount = 120;
  for (int n = 0; n < kCount; ++n) {
    const double z = (2 * n + 1.0) / kCount - 1, ring = std::sqrt(1 - z * z), angle = 2.399963 * n;
    molecule.atoms.push_back(
        {.position = V3d(ring * std::cos(angle), ring * std::sin(angle), z) * 6, .element = 6});
  }
  return molecule;
}

/// Area and volume of the cavity of hollowMolecule(), by points on the spheres of its atoms.
levelset::MoleculeCavity sampledCavity(const Molecule& molecule, double probe) {
  constexpr int kCount = 4000;
  levelset::MoleculeCavity cavity;
  std::vector<std::size_t> near;
  for (const levelset::Atom& atom : molecule.atoms) {
    const double radius = levelset::vanDerWaalsRadius(atom.element) + probe;
    near.clear();
    for (std::size_t n = 0; n < molecule.atoms.size(); ++n) {
      const double apart = (molecule.atoms[n].position - atom.position).length();
      if (apart > 0 && apart < 2 * radius) near.push_back(n);
    }
    for (int n = 0; n < kCount; ++n) {
      const double z = (2 * n + 1.0) / kCount - 1, ring = std::sqrt(1 - z * z),
                   angle = 2.39996322972865332 * n;
      const V3d normal(ring * std::cos(angle), ring * std::sin(angle), z);
      const V3d p = atom.position + normal * radius;
      const bool isCovered = std::any_of(near.begin(), near.end(), [&](std::size_t other) {
        return (p - molecule.atoms[other].position).length() < radius;
      });
      if (isCovered || p.length() > 6) continue;
      const double area = 4 * std::numbers::pi * radius * radius / kCount;
      cavity.area += area;
      cavity.volume -= area * p.dot(normal) / 3;  // by the divergence theorem
    }
  }
  return cavity;
}

TEST(MoleculeSurface, ListsItsCavities) {
  const Molecule molecule = hollowMolecule();
  for (const auto kind : {MoleculeSurface::VanDerWaals, MoleculeSurface::Accessible}) {
    const auto result = moleculeSurface(molecule, 0.5, {.kind = kind, .cavities = true});
    ASSERT_EQ(result.cavities.size(), 1u);
    EXPECT_EQ(result.cavities[0].atoms.size(), 120u);
    const bool isAccessible = kind == MoleculeSurface::Accessible;
    const auto sampled = sampledCavity(molecule, isAccessible ? 1.4 : 0);
    EXPECT_NEAR(sampled.volume / result.cavities[0].volume, 1,
                measured(isAccessible ? 2.8e-3 : 6e-4));
    EXPECT_NEAR(sampled.area / result.cavities[0].area, 1,
                measured(isAccessible ? 2.9e-3 : 7.5e-4));
    EXPECT_GT(result.cavities[0].volume, isAccessible ? 90 : 250);
  }
  // Cavities of excluded surfaces are those of a mesh. Its errors fall with the voxel.
  std::vector<levelset::MoleculeCavity> found;
  for (const double voxel : {0.4, 0.2}) {
    const auto result = moleculeSurface(molecule, voxel, {.cavities = true});
    ASSERT_EQ(result.cavities.size(), 1u);
    EXPECT_EQ(result.cavities[0].atoms.size(), 120u);
    found.push_back(result.cavities[0]);
  }
  EXPECT_NEAR(found[0].volume / found[1].volume, 1, measured(3.9e-3));
  EXPECT_NEAR(found[0].area / found[1].area, 1, measured(4.8e-3));
  EXPECT_GT(found[1].volume, 250);
  EXPECT_TRUE(moleculeSurface(molecule, 0.5, {}).cavities.empty());
  EXPECT_TRUE(moleculeSurface(chain(20), 0.5, {.cavities = true}).cavities.empty());
}

TEST(MoleculeSurface, Refuses) {
  EXPECT_SAYS(refusal<levelset::InvalidInput>([] { (void)moleculeSurface({}, 0.5); }), "no atoms");
  EXPECT_SAYS(
      refusal<levelset::UsageError>([] { (void)moleculeSurface(chain(3), 0.5, {.probe = 0}); }),
      "probe");
  EXPECT_FALSE(
      refusal<levelset::InvalidInput>([] { (void)moleculeSurface(chain(3), 50); }).empty());
  EXPECT_FALSE(refusal<levelset::ResourceLimit>([] {
                 (void)moleculeSurface(chain(100), 0.05, {.maxMemory = 100'000});
               }).empty());
}

TEST(MoleculeSurface, RefusesCavitiesThatNeedMoreMemoryThanTheBand) {
  const auto isRefused = [](std::size_t bytes, bool cavities) {
    try {
      (void)moleculeSurface(chain(20), 0.2, {.cavities = cavities, .maxMemory = bytes});
    } catch (const levelset::ResourceLimit&) {
      return true;
    }
    return false;
  };
  std::size_t bytes = 100'000;
  while (isRefused(bytes, false)) bytes += bytes / 4;
  EXPECT_TRUE(isRefused(bytes, true)) << bytes;
  EXPECT_FALSE(isRefused(3 * bytes, true)) << bytes;
}

}  // namespace molecule_surface_test
