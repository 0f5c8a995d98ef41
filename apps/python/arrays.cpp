#include "apps/python/arrays.h"

#include <fmt/core.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "levelset/error.h"
#include "levelset/progress.h"
#include "levelset/segmented/meshing/segmented_distance.h"
#include "levelset/vdb.h"

namespace py = pybind11;

namespace python {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::TriMesh;
using openvdb::Coord;

std::string shapeText(const py::array& array) {
  return py::str(array.attr("shape")).cast<std::string>() + " of " +
         py::str(array.dtype()).cast<std::string>();
}

void requireRows(const py::array& array, const char* name, const char* kinds,
                 const char* expected) {
  const bool isKind = std::strchr(kinds, array.dtype().kind()) != nullptr;
  if (isKind && array.ndim() == 2 && array.shape(1) == 3) return;
  throw InvalidInput(fmt::format("Mesh: the array {} has shape {}; give shape (n, 3) of {}", name,
                                 shapeText(array), expected));
}

/// Positions or directions as doubles.
py::array_t<double, py::array::c_style | py::array::forcecast> floatRows(const py::array& array,
                                                                         const char* caller,
                                                                         const char* name) {
  const bool isFloat = array.dtype().kind() == 'f';
  if (!isFloat || array.ndim() != 2 || array.shape(1) != 3)
    throw InvalidInput(
        fmt::format("{}: the array {} has shape {}; give shape (n, 3) of float32 or float64",
                    caller, name, shapeText(array)));
  return array;
}

/// Read-only numpy view of rows of numbers. The view keeps `owner` alive, which holds the rows.
template <typename Row, typename T, std::size_t columns>
py::object rowsView(const py::object& owner, const std::vector<Row>& rows) {
  static_assert(sizeof(Row) == columns * sizeof(T));
  const auto* begin = rows.empty() ? nullptr : reinterpret_cast<const T*>(rows.data());
  py::array_t<T> view(std::vector<py::ssize_t>{static_cast<py::ssize_t>(rows.size()), columns},
                      begin, owner);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

}  // namespace

TriMesh meshFromArrays(const py::array& vertices, const py::array& faces) {
  requireRows(vertices, "vertices", "f", "float32 or float64");
  requireRows(faces, "faces", "iu", "integers");
  const auto places = py::array_t<double, py::array::c_style | py::array::forcecast>(vertices);
  const auto corners = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>(faces);
  TriMesh mesh;
  if (vertices.itemsize() < 8) mesh.precision = levelset::CoordinatePrecision::Float;
  const py::ssize_t count = places.shape(0);
  const double* p = places.data();
  for (py::ssize_t i = 0; i < count; ++i, p += 3) {
    const V3d position(p[0], p[1], p[2]);
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      throw InvalidInput(
          fmt::format("Mesh: vertex {} is ({}, {}, {}); give finite numbers", i, p[0], p[1], p[2]));
    mesh.positions.push_back(position);
  }
  const std::int64_t* c = corners.data();
  for (py::ssize_t i = 0; i < corners.shape(0); ++i, c += 3) {
    for (int k = 0; k < 3; ++k)
      if (c[k] < 0 || c[k] >= count || c[k] > std::int64_t{0xffffffff})
        throw InvalidInput(
            fmt::format("Mesh: face {} uses vertex {}, but there are {} vertices, numbered from 0",
                        i, c[k], count));
    mesh.triangles.push_back({static_cast<std::uint32_t>(c[0]), static_cast<std::uint32_t>(c[1]),
                              static_cast<std::uint32_t>(c[2])});
  }
  return mesh;
}

py::object meshArray(const py::object& owner, const TriMesh& mesh, const std::string& list) {
  const levelset::MeshAttributes& attributes = mesh.attributes;
  if (list == "vertices") return rowsView<V3d, double, 3>(owner, mesh.positions);
  if (list == "faces")
    return rowsView<std::array<std::uint32_t, 3>, std::uint32_t, 3>(owner, mesh.triangles);
  if (list == "normals" && !attributes.normals.empty())
    return rowsView<V3d, double, 3>(owner, attributes.normals);
  if (list == "uvs" && !attributes.uvs.empty())
    return rowsView<Imath::V2d, double, 2>(owner, attributes.uvs);
  if (list == "colors" && !attributes.colors.empty())
    return rowsView<Imath::V4f, float, 4>(owner, attributes.colors);
  return py::none();
}

py::object cloudArray(const py::object& owner, const levelset::PointCloud& cloud,
                      const std::string& list) {
  if (list == "positions") return rowsView<V3d, double, 3>(owner, cloud.positions);
  if (list == "normals" && !cloud.normals.empty())
    return rowsView<Imath::V3f, float, 3>(owner, cloud.normals);
  if (list == "colors" && !cloud.colors.empty())
    return rowsView<Imath::V4f, float, 4>(owner, cloud.colors);
  if (list == "radii" && !cloud.radii.empty())
    return rowsView<float, float, 1>(owner, cloud.radii).attr("reshape")(-1);
  if (list == "weights" && !cloud.weights.empty())
    return rowsView<float, float, 1>(owner, cloud.weights).attr("reshape")(-1);
  return py::none();
}

levelset::PointCloud cloudFromArrays(const py::array& positions, const py::object& normals) {
  const auto places = floatRows(positions, "PointCloud", "positions");
  levelset::PointCloud cloud;
  if (positions.itemsize() < 8) cloud.precision = levelset::CoordinatePrecision::Float;
  const double* p = places.data();
  for (py::ssize_t i = 0; i < places.shape(0); ++i, p += 3)
    cloud.positions.emplace_back(p[0], p[1], p[2]);
  if (!normals.is_none()) {
    const auto directions = floatRows(py::array(normals), "PointCloud", "normals");
    const double* n = directions.data();
    for (py::ssize_t i = 0; i < directions.shape(0); ++i, n += 3)
      cloud.normals.emplace_back(Imath::V3d(n[0], n[1], n[2]));
  }
  levelset::withContext("PointCloud", [&] { levelset::requirePoints(cloud); });
  return cloud;
}

levelset::HeightField terrainFromArray(const py::array& heights, const Imath::V2d& spacing,
                                       const Imath::V2d& origin) {
  if (heights.dtype().kind() != 'f' || heights.ndim() != 2)
    throw InvalidInput(
        fmt::format("Terrain: the array heights has shape {}; give shape (rows, columns) of "
                    "float32 or float64",
                    shapeText(heights)));
  const auto rows = py::array_t<float, py::array::c_style | py::array::forcecast>(heights);
  constexpr py::ssize_t kMost = 1 << 30;
  if (rows.shape(0) > kMost || rows.shape(1) > kMost)
    throw InvalidInput("Terrain: more than 2^30 rows or columns; give a part");
  levelset::HeightField terrain{.columns = static_cast<int>(rows.shape(1)),
                                .rows = static_cast<int>(rows.shape(0)),
                                .origin = origin,
                                .spacing = spacing};
  terrain.heights.assign(rows.data(), rows.data() + rows.size());
  levelset::withContext("Terrain", [&] { levelset::requireHeights(terrain); });
  return terrain;
}

py::object terrainArray(const py::object& owner, const levelset::HeightField& terrain) {
  return rowsView<float, float, 1>(owner, terrain.heights)
      .attr("reshape")(terrain.rows, terrain.columns);
}

levelset::ControlLattice latticeFromArray(const py::array& points, const Imath::Box3d& box,
                                          const std::array<int, 3>& degree) {
  if (points.dtype().kind() != 'f' || points.ndim() != 4 || points.shape(3) != 3)
    throw InvalidInput(
        fmt::format("Deformation: the array points has shape {}; give shape (l, m, n, 3) of "
                    "float32 or float64",
                    shapeText(points)));
  const auto rows = py::array_t<double, py::array::c_style | py::array::forcecast>(points);
  if (rows.size() / 3 > static_cast<py::ssize_t>(levelset::kMostControlPoints))
    throw InvalidInput(fmt::format("Deformation: more than {} control points; give fewer",
                                   levelset::kMostControlPoints));
  return levelset::withContext("Deformation", [&] {
    levelset::LatticeData data;
    data.boxToWorld = levelset::frameOf(box);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto count = static_cast<std::size_t>(rows.shape(static_cast<py::ssize_t>(axis)));
      const int usual = static_cast<int>(std::clamp<std::size_t>(count, 2, 4)) - 1;
      data.axes[axis] = levelset::uniformAxis(degree[axis] != 0 ? degree[axis] : usual, count);
    }
    const double* p = rows.data();
    for (py::ssize_t n = 0; n < rows.size(); n += 3, p += 3)
      data.points.emplace_back(p[0], p[1], p[2]);
    return levelset::ControlLattice(std::move(data));
  });
}

py::object latticeArray(const py::object& owner, const levelset::ControlLattice& lattice) {
  const levelset::LatticeData& data = lattice.data();
  return rowsView<V3d, double, 3>(owner, data.points)
      .attr("reshape")(data.axes[0].count(), data.axes[1].count(), data.axes[2].count(), 3);
}

py::array_t<double> distancesAt(const levelset::AdaptiveField& field, const py::array& points) {
  const auto places = floatRows(points, "distances", "points");
  const py::ssize_t count = places.shape(0);
  py::array_t<double> result(count);
  const double* p = places.data();
  double* distance = result.mutable_data();
  const py::gil_scoped_release release;
  const levelset::AdaptiveSampler sampler(field);
  for (py::ssize_t i = 0; i < count; ++i, p += 3)
    distance[i] = sampler.value(V3d(p[0], p[1], p[2]));
  return result;
}

py::array_t<std::uint16_t> labelsAt(const levelset::SegmentedField& field,
                                    const py::array& points) {
  const auto places = floatRows(points, "labels_at", "points");
  const py::ssize_t count = places.shape(0);
  py::array_t<std::uint16_t> result(count);
  const double* p = places.data();
  std::uint16_t* label = result.mutable_data();
  const py::gil_scoped_release release;
  const levelset::SegmentedSampler sampler(field);
  for (py::ssize_t i = 0; i < count; ++i, p += 3) label[i] = sampler.label(V3d(p[0], p[1], p[2]));
  return result;
}

py::array_t<double> segmentedDistances(const levelset::SegmentedField& field,
                                       const py::array& points,
                                       std::optional<levelset::RegionLabel> region, bool onlySheets,
                                       std::size_t maxMemory) {
  const char* name = onlySheets ? "sheet_distances" : "distances";
  const auto places = floatRows(points, name, "points");
  const py::ssize_t count = places.shape(0);
  py::array_t<double> result(count);
  const double* p = places.data();
  double* distance = result.mutable_data();
  const py::gil_scoped_release release;
  levelset::withContext(name, [&] {
    const levelset::SegmentedDistance distances(
        field, {.region = region, .onlySheets = onlySheets, .maxMemory = maxMemory});
    for (py::ssize_t i = 0; i < count; ++i, p += 3)
      distance[i] = distances.value(V3d(p[0], p[1], p[2]));
  });
  return result;
}

DenseBand bandArray(const levelset::NarrowBand& band, const std::optional<Imath::Box3d>& box,
                    std::size_t maxMemory) {
  const openvdb::FloatGrid& grid = levelset::vdb(band);
  const Imath::M44d matrix = band.indexToWorld();
  const double voxel = band.voxelSize();
  for (int i = 0; i < 3; ++i)
    if (std::abs(matrix[i][i] - voxel) > 1e-6 * voxel)
      throw InvalidInput(
          "array: the grid is rotated against the axes; call resample(), or transform() with "
          "bake=True, first");
  openvdb::CoordBBox range = grid.evalActiveVoxelBoundingBox();
  if (box) {
    const openvdb::Vec3d low = grid.worldToIndex(levelset::toVdb(box->min)),
                         high = grid.worldToIndex(levelset::toVdb(box->max));
    const openvdb::Vec3d slack(1e-6);
    range = {Coord::ceil(low - slack), Coord::floor(high + slack)};
  }
  if (range.empty())
    throw InvalidInput(box ? "array: the box contains no grid point; give a larger box"
                           : "array: the level set is empty; give a box");
  const openvdb::Vec3d size = range.extents().asVec3d();
  levelset::withContext("array", [&] {
    levelset::requireMemory(size[0] * size[1] * size[2] * sizeof(float), maxMemory);
  });
  const Coord dim = range.dim();
  py::array_t<float> values({dim.x(), dim.y(), dim.z()});
  openvdb::tools::Dense<float> dense(range, values.mutable_data());  // z varies fastest
  {
    const py::gil_scoped_release release;
    openvdb::tools::copyToDense(grid, dense);
  }
  return {std::move(values), levelset::toImath(grid.indexToWorld(range.min()))};
}

levelset::NarrowBand bandOfSamples(const V3d& origin, double voxel,
                                   const py::array_t<std::int32_t>& blocks,
                                   const py::array_t<float>& values,
                                   const py::array_t<std::int32_t>& inside) {
  using Leaf = openvdb::FloatTree::LeafNodeType;
  auto transform = levelset::uniformTransform(voxel);
  transform->postTranslate(levelset::toVdb(origin));
  // The background is larger than all samples, so that it adds no surface beside the blocks.
  auto largest = static_cast<float>(voxel);
  for (py::ssize_t i = 0; i < values.size(); ++i)
    largest = std::max(largest, std::abs(values.data()[i]));
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(2 * largest);
  grid->setTransform(transform);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  openvdb::FloatTree& tree = grid->tree();
  const auto coord = [](const auto& of, py::ssize_t i) {
    constexpr auto kSide = static_cast<std::int32_t>(Leaf::DIM);
    return Coord(kSide * of(i, 0), kSide * of(i, 1), kSide * of(i, 2));
  };
  const auto tiles = inside.unchecked<2>(), places = blocks.unchecked<2>();
  for (py::ssize_t i = 0; i < tiles.shape(0); ++i)
    tree.addTile(1, coord(tiles, i), -grid->background(), false);
  const float* samples = values.data();
  for (py::ssize_t i = 0; i < places.shape(0); ++i, samples += Leaf::SIZE) {
    auto* leaf = new Leaf(coord(places, i), 0.0F, true);
    std::copy(samples, samples + Leaf::SIZE,
              leaf->buffer().data());  // z varies fastest in the samples and in the leaf
    tree.addLeaf(leaf);
  }
  return levelset::makeBand(grid);
}

}  // namespace python
