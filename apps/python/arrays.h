#pragma once

#include <Imath/ImathBox.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <optional>

#include "apps/pipeline/values/value.h"

/// Conversions between values and numpy arrays.
namespace python {

/// Builds a mesh from numpy arrays.
/// @param vertices  n × 3 floats
/// @param faces  m × 3 integers
/// @throws levelset::InvalidInput for other shapes and types, numbers that are not finite, and
///         faces with invalid vertex numbers
[[nodiscard]] levelset::TriMesh meshFromArrays(const pybind11::array& vertices,
                                               const pybind11::array& faces);

/// Returns a list of a mesh as a read-only numpy array that shares its memory; None for an
/// attribute that the mesh does not have.
/// @param owner  Python object that keeps the mesh alive
/// @param list   vertices, faces, normals, uvs or colors
[[nodiscard]] pybind11::object meshArray(const pybind11::object& owner,
                                         const levelset::TriMesh& mesh, const std::string& list);

/// Builds a point cloud from numpy arrays.
/// @param positions  n × 3 floats
/// @param normals  n × 3 floats, or None
/// @throws levelset::InvalidInput for other shapes and types, and numbers that are not finite
[[nodiscard]] levelset::PointCloud cloudFromArrays(const pybind11::array& positions,
                                                   const pybind11::object& normals);

/// Returns a list of a point cloud as a read-only numpy array that shares its memory; None for an
/// attribute that the cloud does not have.
/// @param owner  Python object that keeps the cloud alive
/// @param list   positions, normals, colors, radii or weights
[[nodiscard]] pybind11::object cloudArray(const pybind11::object& owner,
                                          const levelset::PointCloud& cloud,
                                          const std::string& list);

/// Builds a terrain from a numpy array.
/// @param heights  rows × columns floats, the first row at the least y; NaN: missing
/// @throws levelset::InvalidInput for other shapes and types, infinite heights, and a spacing that
///         is not positive
[[nodiscard]] levelset::HeightField terrainFromArray(const pybind11::array& heights,
                                                     const Imath::V2d& spacing,
                                                     const Imath::V2d& origin);

/// Returns the heights of a terrain as a read-only numpy array that shares its memory.
/// @param owner  Python object that keeps the terrain alive
[[nodiscard]] pybind11::object terrainArray(const pybind11::object& owner,
                                            const levelset::HeightField& terrain);

/// Builds a lattice from a numpy array.
/// @param points  control points, l × m × n × 3 floats
/// @param degree  along each axis, 0: 3, or less with fewer than 4 points
/// @throws levelset::InvalidInput for other shapes and types, and as levelset::ControlLattice
[[nodiscard]] levelset::ControlLattice latticeFromArray(const pybind11::array& points,
                                                        const Imath::Box3d& box,
                                                        const std::array<int, 3>& degree);

/// Returns the control points of a lattice as a read-only numpy array that shares its memory.
/// @param owner  Python object that keeps the lattice alive
[[nodiscard]] pybind11::object latticeArray(const pybind11::object& owner,
                                            const levelset::ControlLattice& lattice);

/// Samples an adaptive field.
/// @param points  n × 3 floats, world units
/// @return n distances, float64; NaN for points that are not finite
/// @throws levelset::InvalidInput for other shapes and types
[[nodiscard]] pybind11::array_t<double> distancesAt(const levelset::AdaptiveField& field,
                                                    const pybind11::array& points);

/// Finds the regions of a segmentation at points.
/// @param points  n × 3 floats, world units
/// @return n labels; 0 for the void
/// @throws levelset::InvalidInput for other shapes and types
[[nodiscard]] pybind11::array_t<std::uint16_t> labelsAt(const levelset::SegmentedField& field,
                                                        const pybind11::array& points);

/// Computes distances from the interfaces and sheets of a segmentation.
/// @param points  n × 3 floats, world units
/// @param region  its boundary counts, and distances inside it are negative; empty: all surfaces
/// @param onlySheets  sheets count, interfaces do not
/// @return n distances, float64; NaN for points that are not finite, infinite without a surface
/// @throws levelset::InvalidInput for other shapes and types
/// @throws levelset::UsageError for a region that the segmentation does not have
/// @throws levelset::ResourceLimit
[[nodiscard]] pybind11::array_t<double> segmentedDistances(
    const levelset::SegmentedField& field, const pybind11::array& points,
    std::optional<levelset::RegionLabel> region, bool onlySheets, std::size_t maxMemory);

/// Signed distances at the grid points of a box.
struct DenseBand {
  pybind11::array_t<float> values;
  Imath::V3d origin;  ///< world position of the first grid point
};
/// Reads the values of a band at the grid points of a box.
/// @param box  world units; default: the box of the active voxels
/// @throws levelset::InvalidInput for a band whose grid is rotated against the axes
/// @throws levelset::ResourceLimit for too many grid points
[[nodiscard]] DenseBand bandArray(const levelset::NarrowBand& band,
                                  const std::optional<Imath::Box3d>& box, std::size_t maxMemory);

/// Builds a band from samples of a function. Its zero set is correct, but its values need not be
/// distances: the action `reinitialize` computes distances.
/// @param origin  world position of the grid point with index (0, 0, 0)
/// @param voxel  voxel size, world units
/// @param blocks  n × 3 block coordinates: grid indices divided by 8; blocks have 8³ grid points
/// @param values  n × 8 × 8 × 8 samples of these blocks
/// @param inside  m × 3 coordinates of blocks that lie inside the solid and have no samples
[[nodiscard]] levelset::NarrowBand bandOfSamples(const Imath::V3d& origin, double voxel,
                                                 const pybind11::array_t<std::int32_t>& blocks,
                                                 const pybind11::array_t<float>& values,
                                                 const pybind11::array_t<std::int32_t>& inside);

}  // namespace python
