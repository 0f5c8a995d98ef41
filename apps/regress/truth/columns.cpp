#include "apps/regress/truth/columns.h"

namespace regress {

const std::vector<Column>& columns() {
  static const std::vector<Column> all = {
      {"voxel_size", "voxel", "edge of a voxel, world units"},
      {"active_voxels", "active", "active voxels of the result"},
      {"band_in_l1_vx", "in L1", "mean error of the band inside the solid, voxels"},
      {"band_in_linf_vx", "in L∞", "largest error of the band inside the solid, voxels"},
      {"band_out_l1_vx", "out L1", "mean error of the band outside the solid, voxels"},
      {"band_out_linf_vx", "out L∞", "largest error of the band outside the solid, voxels"},
      {"band_in_l1", "in L1 (world)", "the same in world units"},
      {"band_in_linf", "in L∞ (world)", "the same in world units"},
      {"band_out_l1", "out L1 (world)", "the same in world units"},
      {"band_out_linf", "out L∞ (world)", "the same in world units"},
      {"missing_band", "gaps",
       "share of the exact band's grid points that the result lacks, up to a voxel below the half "
       "width"},
      {"surface_l1_vx", "surface L1",
       "mean exact distance of the zeros of the tricubic interpolant along 10000 rays, voxels"},
      {"surface_linf_vx", "surface L∞", "largest of these distances, voxels"},
      {"surface_l1", "surface L1 (world)", "the same in world units"},
      {"surface_linf", "surface L∞ (world)", "the same in world units"},
      {"surface_hits", "hits", "zeros found along the rays"},
      {"missed_hits", "missed",
       "missing and surplus zeros along the rays, over the zeros of the exact solid"},
      {"mesh_l1_vx", "mesh L1",
       "mean exact distance of vertices and face centres of the mesh of the result, voxels"},
      {"mesh_linf_vx", "mesh L∞", "largest of these distances, voxels"},
      {"volume_error", "volume", "relative error of the volume, signed"},
      {"area_error", "area", "relative error of the area, signed"},
      {"eikonal_mean", "eikonal", "mean of ||∇φ| − 1| over the band"},
      {"eikonal_max", "eikonal max", "largest ||∇φ| − 1|"},
      {"checks_failed", "checks", "level-set checks that the result fails"},
      {"cavities", "cavities", "enclosed voids of a solid that has none"},
      {"deviation_vx", "deviation",
       "largest difference between two bands that must be equal, voxels"},
      {"value_error", "value", "error of a number with an exact answer, as the case defines it"},
      {"order_band_l1", "order L1", "observed order of the band's mean error, world units"},
      {"order_band_linf", "order L∞", "observed order of the band's largest error, world units"},
      {"order_surface", "order surface", "observed order of the surface's mean error, world units"},
      {"order_volume", "order volume", "observed order of the volume's error"},
      {"cpu_s", "CPU s", "CPU seconds of the operator, all threads"},
      {"peak_bytes", "peak", "growth of the resident set while the operator ran, bytes"},
  };
  return all;
}

}  // namespace regress
