#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/pipeline/registry/operator.h"
#include "levelset/deform/deformation.h"
#include "levelset/progress.h"

/// The action `deform`: solids, meshes and point clouds through a lattice of control points.
namespace pipeline {

[[nodiscard]] Operator deformOperator();

/// Options of deformed(). Empty ones have the defaults of `deform`.
struct DeformValueOptions {
  std::optional<double> voxelSize = {};  ///< voxel size of a level set, world units
  std::optional<double> halfWidth = {};  ///< half width of a level set, voxels
  std::optional<double> tolerance = {};  ///< tolerance of a mesh, world units
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

struct DeformedValue {
  Value value;
  levelset::FoldCertificate certificate;
  // As levelset::DeformMeshResult; 0 without a mesh.
  std::size_t halvedEdges = 0;
  double bend = 0;
};

/// Deforms a level set, a mesh or a point cloud, as `deform` does.
/// @throws as levelset::deformBand(), deformMesh() and deformPoints()
[[nodiscard]] DeformedValue deformed(const Value& operand, const levelset::Deformation& map,
                                     const DeformValueOptions& options);

/// The certificate as it is in the report.
[[nodiscard]] nlohmann::ordered_json foldCertificateJson(
    const levelset::FoldCertificate& certificate);

}  // namespace pipeline
