#include "apps/regress/errors.h"

#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

#include "apps/regress/truth/gaps.h"
#include "apps/regress/truth/rays.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/compare.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/transform/resample.h"
#include "levelset/vdb.h"

namespace regress {

using Imath::V3d;
using levelset::NarrowBand;

namespace {

/// Sum, maximum and number of absolute errors, world units.
struct Tally {
  double sum = 0, largest = 0, count = 0;
  void add(double error) {
    sum += std::abs(error);
    largest = std::max(largest, std::abs(error));
    ++count;
  }
  void add(const Tally& other) {
    sum += other.sum;
    largest = std::max(largest, other.largest);
    count += other.count;
  }
  [[nodiscard]] double mean() const { return count > 0 ? sum / count : 0; }
};

struct BandErrors {
  Tally inside, outside;
  GapCount gaps;
};

using Leaf = openvdb::FloatTree::LeafNodeType;

/// Collects the errors of the active voxels of a leaf, and of inactive voxels whose exact distance
/// lies within the band. Counts the gaps in the leaf, since the exact distances can take long.
BandErrors leafErrors(const Leaf& leaf, const openvdb::FloatGrid& grid, const Truth& truth,
                      const Region& region) {
  BandErrors errors;
  const double background = static_cast<double>(grid.background());
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const V3d p = levelset::toImath(grid.indexToWorld(leaf.offsetToGlobalCoord(i)));
    if (truth.compared && !truth.compared(p)) continue;
    const double exact = truth.distance(p);
    if (exact > region.low && exact < region.high)
      errors.gaps.add({.wanted = 1, .missing = leaf.isValueOn(i) ? 0.0 : 1.0});
    if (!leaf.isValueOn(i) && std::abs(exact) >= background) continue;
    (exact < 0 ? errors.inside : errors.outside).add(static_cast<double>(leaf.getValue(i)) - exact);
  }
  return errors;
}

BandErrors bandErrors(const NarrowBand& band, const Truth& truth) {
  const openvdb::FloatGrid& grid = levelset::vdb(band);
  const Region region = bandRegion(truth, band.halfWidth(), band.voxelSize());
  std::vector<const Leaf*> leaves;
  grid.tree().getNodes(leaves);
  std::vector<BandErrors> parts(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(),
                    [&](std::size_t i) { parts[i] = leafErrors(*leaves[i], grid, truth, region); });
  BandErrors all;
  for (const BandErrors& part : parts) {
    all.inside.add(part.inside);
    all.outside.add(part.outside);
    all.gaps.add(part.gaps);
  }
  all.gaps.add(countWithoutLeaf(region, grid));
  return all;
}

Tally meshErrors(const NarrowBand& result, const Truth& truth, Mesher mesher) {
  Tally tally;
  if (mesher == Mesher::Ours) {
    const levelset::TriMesh mesh = levelset::bandToMesh(result);
    for (const V3d& p : mesh.positions) tally.add(truth.distance(p));
    for (const auto& t : mesh.triangles)
      tally.add(truth.distance(
          (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0));
    return tally;
  }
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(levelset::vdb(result), points, quads);
  const auto at = [&](openvdb::Index32 i) { return levelset::toImath(openvdb::Vec3d(points[i])); };
  for (openvdb::Index32 i = 0; i < points.size(); ++i) tally.add(truth.distance(at(i)));
  // Renderers draw each quad as two triangles, so the error counts at the centre of each triangle
  // too.
  for (const openvdb::Vec4I& q : quads)
    for (const int k : {1, 2})
      tally.add(truth.distance((at(q[0]) + at(q[k]) + at(q[k + 1])) / 3.0));
  return tally;
}

void addTally(const std::string& name, const Tally& tally, double voxelSize, Figures& figures) {
  if (!(tally.count > 0)) return;
  figures[name + "_l1_vx"] = tally.mean() / voxelSize;
  figures[name + "_linf_vx"] = tally.largest / voxelSize;
  figures[name + "_l1"] = tally.mean();
  figures[name + "_linf"] = tally.largest;
}

}  // namespace

void addErrors(const NarrowBand& result, const Truth& truth, Mesher mesher, Figures& figures,
               int rays) {
  const double h = result.voxelSize();
  figures["voxel_size"] = h;
  figures["active_voxels"] = static_cast<double>(result.activeVoxelCount());
  const BandErrors band = bandErrors(result, truth);
  addTally("band_in", band.inside, h, figures);
  addTally("band_out", band.outside, h, figures);
  figures["missing_band"] = band.gaps.share();

  const RayHits hits = shootRays(result, truth, rays);
  Tally surface;
  for (const double error : hits.errors) surface.add(error);
  addTally("surface", surface, h, figures);
  figures["surface_hits"] = surface.count;
  figures["missed_hits"] = hits.exactHits > 0 ? hits.different / hits.exactHits : surface.count;

  const Tally mesh = meshErrors(result, truth, mesher);
  figures["mesh_l1_vx"] = mesh.mean() / h;
  figures["mesh_linf_vx"] = mesh.largest / h;
}

void addDifferences(const NarrowBand& result, const NarrowBand& reference, Figures& figures) {
  const double h = result.voxelSize();
  figures["voxel_size"] = h;
  figures["active_voxels"] = static_cast<double>(result.activeVoxelCount());
  const levelset::Comparison c = levelset::compare(result, reference);
  figures["surface_l1"] = std::max(c.meanAtoB, c.meanBtoA);
  figures["surface_linf"] = c.hausdorff();
  figures["surface_l1_vx"] = figures["surface_l1"] / h;
  figures["surface_linf_vx"] = figures["surface_linf"] / h;
  const double volume = levelset::measure(reference).volume;
  figures["volume_error"] = levelset::measure(result).volume / volume - 1;
  figures["value_error"] = c.symmetricDifference / volume;
}

void addInvariants(const NarrowBand& result, const Truth& truth, Figures& figures) {
  const levelset::Measurement m = levelset::measure(result);
  if (truth.volume) figures["volume_error"] = m.volume / *truth.volume - 1;
  if (truth.area) figures["area_error"] = m.area / *truth.area - 1;
  const levelset::CheckReport report = levelset::check(result);
  figures["eikonal_mean"] = report.eikonalMean;
  figures["eikonal_max"] = report.eikonalMax;
  double failed = 0;
  for (const levelset::CheckItem& item : report.items) failed += item.passed ? 0 : 1;
  figures["checks_failed"] = failed;
}

double deviation(const NarrowBand& a, const NarrowBand& b) {
  if (!levelset::shareGrid(a, b)) return std::numeric_limits<double>::infinity();
  double largest = 0;
  const auto compare = [&](const NarrowBand& from, const NarrowBand& to) {
    auto accessor = levelset::vdb(to).getConstAccessor();
    for (auto it = levelset::vdb(from).cbeginValueOn(); it; ++it)
      largest = std::max(largest, std::abs(static_cast<double>(*it) -
                                           static_cast<double>(accessor.getValue(it.getCoord()))));
  };
  compare(a, b);
  compare(b, a);
  return largest / a.voxelSize();
}

}  // namespace regress
