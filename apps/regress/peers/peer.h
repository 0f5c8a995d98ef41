#pragma once

#include <Imath/ImathVec.h>

#include "levelset/csg/csg.h"
#include "levelset/fields/field.h"
#include "levelset/mesh.h"
#include "levelset/narrow_band.h"

/// OpenVDB 10's own tools with their defaults, on the same input as Levelsmith's operators.
namespace regress::peer {

inline constexpr const char* kRebuild = "OpenVDB levelSetRebuild";
inline constexpr const char* kSweep = "OpenVDB sdfToSdf";
inline constexpr const char* kFilter = "OpenVDB LevelSetFilter";
inline constexpr const char* kCsg = "OpenVDB csg + levelSetRebuild";
inline constexpr const char* kDilate = "OpenVDB dilateSdf";
inline constexpr const char* kCurvature = "OpenVDB meanCurvature";
inline constexpr const char* kAdvect = "OpenVDB LevelSetAdvection";
inline constexpr const char* kShapes = "OpenVDB createLevelSet";
inline constexpr const char* kMesh = "OpenVDB meshToLevelSet";
inline constexpr const char* kResample = "OpenVDB resampleToMatch";

[[nodiscard]] levelset::NarrowBand sphere(double radius, const Imath::V3d& centre,
                                          double voxelSize);
[[nodiscard]] levelset::NarrowBand box(const Imath::V3d& size, const Imath::V3d& centre,
                                       double voxelSize);
[[nodiscard]] levelset::NarrowBand fromMesh(const levelset::TriMesh& mesh, double voxelSize);
[[nodiscard]] levelset::NarrowBand rebuild(const levelset::NarrowBand& band);
[[nodiscard]] levelset::NarrowBand sweep(const levelset::NarrowBand& band);
[[nodiscard]] levelset::NarrowBand offset(const levelset::NarrowBand& band, double distance);
[[nodiscard]] levelset::NarrowBand combine(levelset::CsgOperation operation,
                                           const levelset::NarrowBand& a,
                                           const levelset::NarrowBand& b);
/// Widens the band by `voxels` on both sides.
[[nodiscard]] levelset::NarrowBand dilate(const levelset::NarrowBand& band, int voxels);
[[nodiscard]] levelset::NarrowBand curvatureFlow(const levelset::NarrowBand& band, double time);
/// Smooths by four passes of a box filter of three voxels: σ = √(8/3).
[[nodiscard]] levelset::NarrowBand gaussian(const levelset::NarrowBand& band);
/// Advects a band with HJ-WENO5 and TVD-RK3.
/// @param turnsBack  true: the velocity vanishes at half of `time`. OpenVDB would stop there, so a
///         small time interval around it is skipped.
[[nodiscard]] levelset::NarrowBand advect(const levelset::NarrowBand& band,
                                          const levelset::VectorField& velocity, double time,
                                          bool turnsBack);
/// Samples the velocity at time 0 on a staggered grid over the unit cube.
[[nodiscard]] levelset::VectorField staggered(const levelset::VectorField& velocity,
                                              double voxelSize);
[[nodiscard]] levelset::NarrowBand resample(const levelset::NarrowBand& band, double voxelSize);

}  // namespace regress::peer
