#pragma once

#include "apps/regress/case.h"
#include "apps/regress/truth/rays.h"
#include "levelset/narrow_band.h"

/// Errors of a band against the truth.
namespace regress {

/// Surface extraction that builds the mesh of the mesh columns.
enum class Mesher { Ours, OpenVdb };

/// Adds all columns that compare `result` with `truth`. Both sides of the surface have columns of
/// their own.
void addErrors(const levelset::NarrowBand& result, const Truth& truth, Mesher mesher,
               Figures& figures, int rays = kRayCount);

/// Adds the surface columns, the volume and, as the value, the volume of the symmetric difference.
/// The reference band stands for the truth. Distances are the larger of both directions.
void addDifferences(const levelset::NarrowBand& result, const levelset::NarrowBand& reference,
                    Figures& figures);

/// Adds volume, area, eikonal residual and checks.
void addInvariants(const levelset::NarrowBand& result, const Truth& truth, Figures& figures);

/// Largest difference of φ over the grid points at which either band is active, in voxels;
/// infinite where the grids differ.
[[nodiscard]] double deviation(const levelset::NarrowBand& a, const levelset::NarrowBand& b);

}  // namespace regress
