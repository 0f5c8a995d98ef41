#include "apps/viewer/editing/deform_design.h"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "apps/viewer/editing/solid_model.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/mesh_files/mesh_file.h"

namespace viewer {

using Imath::V3d;

DeformDesign::DeformDesign(levelset::ControlLattice lattice) : map_(std::move(lattice)) {}

DeformDesign::DeformDesign(levelset::CageDeformation cage, std::filesystem::path restFile)
    : map_(std::move(cage)), restFile_(std::move(restFile)) {}

std::shared_ptr<const levelset::Deformation> DeformDesign::deformation() const {
  if (isLattice()) return std::make_shared<levelset::LatticeDeformation>(lattice());
  return std::make_shared<levelset::CageDeformation>(cage());
}

const std::vector<V3d>& DeformDesign::points() const {
  return isLattice() ? lattice().data().points : cage().moved();
}

DeformDesign DeformDesign::withPoints(std::vector<V3d> points) const {
  if (!isLattice()) return {cage().withMoved(std::move(points)), restFile_};
  levelset::LatticeData data = lattice().data();
  data.points = std::move(points);
  return DeformDesign(levelset::ControlLattice(std::move(data)));
}

std::vector<V3d> DeformDesign::restPoints() const {
  if (!hasRestPoints()) return points();
  if (!isLattice()) return cage().rest();
  const levelset::LatticeData& data = lattice().data();
  return levelset::identityLattice(data.axes, data.boxToWorld).data().points;
}

std::vector<std::array<std::size_t, 2>> DeformDesign::net() const {
  std::vector<std::array<std::size_t, 2>> edges;
  if (!isLattice()) {
    std::set<std::array<std::size_t, 2>> all;
    for (const auto& triangle : cage().triangles())
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t a = triangle[i], b = triangle[(i + 1) % 3];
        all.insert({std::min(a, b), std::max(a, b)});
      }
    return {all.begin(), all.end()};
  }
  const auto& axes = lattice().data().axes;
  const std::array<std::size_t, 3> count = {axes[0].count(), axes[1].count(), axes[2].count()},
                                   stride = {count[1] * count[2], count[2], 1};
  for (std::size_t n = 0; n < points().size(); ++n)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (n / stride[axis] % count[axis] + 1 < count[axis]) edges.push_back({n, n + stride[axis]});
  return edges;
}

void DeformDesign::growAlongLayer(int axis, std::vector<char>& isSelected) const {
  if (!isLattice()) return;
  const auto& axes = lattice().data().axes;
  const std::size_t stride = axis == 2 ? 1 : axes[2].count() * (axis == 1 ? 1 : axes[1].count());
  const std::size_t count = axes[static_cast<std::size_t>(axis)].count();
  std::vector<char> isLayer(count, 0);
  for (std::size_t n = 0; n < isSelected.size(); ++n)
    if (isSelected[n]) isLayer[n / stride % count] = 1;
  for (std::size_t n = 0; n < isSelected.size(); ++n) isSelected[n] = isLayer[n / stride % count];
}

void DeformDesign::save(const std::filesystem::path& file) const {
  if (isLattice()) return levelset::writeLattice(file, lattice());
  levelset::TriMesh mesh;
  mesh.positions = cage().moved();
  mesh.triangles = cage().triangles();
  levelset::writeMesh(file, mesh);
}

std::string DeformDesign::action(const std::filesystem::path& file) const {
  if (isLattice()) return "deform --lattice " + quoted(file.string());
  return fmt::format(
      "deform --cage {} --to {}{}", quoted(restFile_.string()), quoted(file.string()),
      cage().coordinates() == levelset::CageCoordinates::Green ? " --coordinates green" : "");
}

DeformDesign boxDesign(const Imath::Box3d& bounds, double voxelSize, const BoxLattice& box) {
  constexpr double kMargin = 2;
  const V3d margin(kMargin * voxelSize);
  std::array<levelset::LatticeAxis, 3> axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int count = std::clamp(box.count[axis], 2, kMostBoxCount);
    axes[axis] = levelset::uniformAxis(std::clamp(box.degree, 1, count - 1),
                                       static_cast<std::size_t>(count));
  }
  return DeformDesign(levelset::identityLattice(
      axes, levelset::frameOf({bounds.min - margin, bounds.max + margin})));
}

DeformDesign readLatticeDesign(const std::filesystem::path& file) {
  return DeformDesign(levelset::readLattice(file));
}

DeformDesign readCageDesign(const std::filesystem::path& rest, const std::filesystem::path& moved,
                            levelset::CageCoordinates coordinates) {
  const auto read = [](const std::filesystem::path& file) {
    return levelset::readMesh(file, {.attributes = false});
  };
  const levelset::TriMesh atRest = read(rest);
  return {levelset::CageDeformation(atRest, moved.empty() ? atRest : read(moved), coordinates),
          rest};
}

}  // namespace viewer
