#include "apps/regress/truth/columns.h"

namespace regress {

const std::vector<Column>& columns() {
  static const std::vector<Column> all = {
      {"voxel_size", "voxel", "voxel size, world units"},
      {"active_voxels", "active", "number of active voxels of the result"},
      {"band_in_l1_vx", "in L1", "mean error of the band inside the solid, voxels"},
      {"band_in_linf_vx", "in L∞", "largest error of the band inside the solid, voxels"},
      {"band_out_l1_vx", "out L1", "mean error of the band outside the solid, voxels"},
      {"band_out_linf_vx", "out L∞", "largest error of the band outside the solid, voxels"},
      {"band_in_l1", "in L1 (world)", "mean error of the band inside the solid, world units"},
      {"band_in_linf", "in L∞ (world)", "largest error of the band inside the solid, world units"},
      {"band_out_l1", "out L1 (world)", "mean error of the band outside the solid, world units"},
      {"band_out_linf", "out L∞ (world)",
       "largest error of the band outside the solid, world units"},
      {"missing_band", "gaps",
       "share of the grid points of the exact band that are not active in the result; grid points "
       "within a voxel of the end of the band do not count"},
      {"surface_l1_vx", "surface L1",
       "mean exact distance of the zeros of the tricubic interpolant along 10000 rays (2500 in the "
       "quick budget), voxels"},
      {"surface_linf_vx", "surface L∞",
       "largest exact distance of the zeros along the rays, voxels"},
      {"surface_l1", "surface L1 (world)",
       "mean exact distance of the zeros along the rays, world units"},
      {"surface_linf", "surface L∞ (world)",
       "largest exact distance of the zeros along the rays, world units"},
      {"surface_hits", "hits", "number of zeros found along the rays"},
      {"missed_hits", "missed",
       "differences in the number of zeros of each ray, summed, over the number of zeros of the "
       "exact "
       "solid"},
      {"mesh_l1_vx", "mesh L1",
       "mean exact distance of vertices and face centres of the mesh of the result, voxels"},
      {"mesh_linf_vx", "mesh L∞",
       "largest exact distance of vertices and face centres of the mesh, voxels"},
      {"volume_error", "volume", "relative error of the volume, signed"},
      {"area_error", "area", "relative error of the area, signed"},
      {"eikonal_mean", "eikonal", "mean of ||∇φ| − 1| over the band"},
      {"eikonal_max", "eikonal max", "largest ||∇φ| − 1| over the band"},
      {"checks_failed", "checks", "number of level-set checks that the result fails"},
      {"cavities", "cavities", "number of enclosed voids in the result; the exact solid has none"},
      {"deviation_vx", "deviation",
       "largest difference between two bands that must be equal, voxels"},
      {"value_error", "value", "error that the definition of the case describes"},
      {"order_band_l1", "order L1",
       "order of convergence, from the previous resolution, of the band's mean error in world "
       "units"},
      {"order_band_linf", "order L∞",
       "order of convergence, from the previous resolution, of the band's largest error in world "
       "units"},
      {"order_surface", "order surface",
       "order of convergence, from the previous resolution, of the surface's mean error in world "
       "units"},
      {"order_volume", "order volume",
       "order of convergence, from the previous resolution, of the volume error"},
      {"cpu_s", "CPU s", "CPU seconds of the operator, all threads"},
      {"peak_bytes", "peak", "growth of the resident set while the operator ran, bytes"},
  };
  return all;
}

}  // namespace regress
