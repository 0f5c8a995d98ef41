#pragma once

#include <Imath/ImathBox.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <optional>

#include "apps/pipeline/values/value.h"

/// Between values and numpy.
namespace python {

/// @param vertices  n × 3 of floats
/// @param faces     m × 3 of whole numbers
/// @throws levelset::InvalidInput for other shapes and types, numbers that are not finite, and
///         faces whose vertices are none
[[nodiscard]] levelset::TriMesh meshFromArrays(const pybind11::array& vertices,
                                               const pybind11::array& faces);

/// One of the lists of a mesh, as a read-only array that shares its memory. Attributes that the
/// mesh does not have are None.
[[nodiscard]] pybind11::object meshArray(const pybind11::object& owner,
                                         const levelset::TriMesh& mesh, const std::string& list);

/// Signed distances at the grid points of a box.
struct DenseBand {
  pybind11::array_t<float> values;
  Imath::V3d origin;  ///< world, of the first
};
/// @param box  world; those of the band where there is none
/// @throws levelset::InvalidInput for a band that is turned against the axes; ResourceLimit
[[nodiscard]] DenseBand bandArray(const levelset::NarrowBand& band,
                                  const std::optional<Imath::Box3d>& box, std::size_t maxMemory);

/// A grid out of samples, with the right zero set and no distances yet: for `reinitialize`.
/// @param blocks  n × 3, the numbers of blocks of 8³ grid points
/// @param values  n × 8 × 8 × 8, their samples
/// @param inside  m × 3, blocks that lie inside and have no samples
[[nodiscard]] levelset::NarrowBand bandOfSamples(const Imath::V3d& origin, double voxel,
                                                 const pybind11::array_t<std::int32_t>& blocks,
                                                 const pybind11::array_t<float>& values,
                                                 const pybind11::array_t<std::int32_t>& inside);

}  // namespace python
