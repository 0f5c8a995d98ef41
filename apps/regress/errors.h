#pragma once

#include "apps/regress/case.h"
#include "apps/regress/truth/rays.h"
#include "levelset/narrow_band.h"

/// Measures the errors of a band against the exact solid.
namespace regress {

/// Mesher that builds the mesh for the columns mesh_l1_vx and mesh_linf_vx.
enum class Mesher { Ours, OpenVdb };

/// Adds the columns with the errors of the band, of its surface and of its mesh. The band has
/// separate columns for the inside and the outside of the solid.
/// @param rays  number of rays along which the surface is measured
void addErrors(const levelset::NarrowBand& result, const Truth& truth, Mesher mesher,
               Figures& figures, int rays = kRayCount);

/// Adds the surface columns and the volume error against a reference band. value_error is the
/// volume of the symmetric difference over the volume of the reference. A surface distance is the
/// larger of the two from `result` to `reference` and back.
void addDifferences(const levelset::NarrowBand& result, const levelset::NarrowBand& reference,
                    Figures& figures);

/// Adds the errors of volume and area, the eikonal residual and the number of failed level-set
/// checks.
void addInvariants(const levelset::NarrowBand& result, const Truth& truth, Figures& figures);

/// Largest difference of φ over the grid points at which either band is active, in voxels;
/// infinite where the grids differ.
[[nodiscard]] double deviation(const levelset::NarrowBand& a, const levelset::NarrowBand& b);

}  // namespace regress
