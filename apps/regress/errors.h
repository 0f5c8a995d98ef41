#pragma once

#include "apps/regress/case.h"
#include "apps/regress/truth/rays.h"
#include "levelset/narrow_band.h"

/// How far a band is from the truth.
namespace regress {

/// Whose surface extraction the column of the mesh is about.
enum class Mesher { Ours, OpenVdb };

/// All columns that compare `result` with `truth`, both sides of the surface apart.
void addErrors(const levelset::NarrowBand& result, const Truth& truth, Mesher mesher,
               Figures& figures, int rays = kRayCount);

/// The surface columns, volume and, as the value, the volume of what is in one of them only,
/// against a band that stands for the truth. Distances are taken both ways, and the worse told.
void addDifferences(const levelset::NarrowBand& result, const levelset::NarrowBand& reference,
                    Figures& figures);

/// Volume, area, eikonal residual and checks.
void addInvariants(const levelset::NarrowBand& result, const Truth& truth, Figures& figures);

/// Largest difference of φ over the grid points at which either band is active, in voxels;
/// infinite where the grids are not the same.
[[nodiscard]] double deviation(const levelset::NarrowBand& a, const levelset::NarrowBand& b);

}  // namespace regress
