#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathPlane.h>

#include "levelset/points/point_cloud.h"

namespace levelset {

/// Transforms a point cloud. Normals transform by the inverse transpose, point outwards afterwards,
/// and become unit vectors; a pure translation keeps them. Radii scale by the cube root of the
/// determinant's magnitude. Files store the new coordinates in double precision.
/// @param matrix  affine and invertible; world' = world * matrix, with Imath's row vectors
/// @throws UsageError if the matrix is not affine and invertible
/// @throws InvalidInput if the lists of the cloud do not fit, a coordinate exceeds 3.4e38, or
///         a radius leaves the range of float
[[nodiscard]] PointCloud transform(PointCloud cloud, const Imath::M44d& matrix);

/// Keeps the points inside a box, with those on its faces.
/// @throws UsageError if the box is empty
/// @throws InvalidInput if no point remains
[[nodiscard]] PointCloud clip(const PointCloud& cloud, const Imath::Box3d& box);

/// Keeps the points on one side of a plane, the side that its normal points away from, with those
/// on the plane.
/// @throws UsageError if the normal or the distance is not finite, or the normal is zero
/// @throws InvalidInput if no point remains
[[nodiscard]] PointCloud clip(const PointCloud& cloud, const Imath::Plane3d& plane);

}  // namespace levelset
