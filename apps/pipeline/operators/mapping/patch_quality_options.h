#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "mapping/distortion/distortion.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/fast_sums/rbf_kernel.h"
#include "mapping/patches/patch.h"

// Certifying, untangling and relaxing of patches, for operators that map onto patches.
namespace pipeline {

/// Appends --untangle, --relax and --sides to `params`.
[[nodiscard]] std::vector<Param> withShell(std::vector<Param> params);
void validateShell(const Invocation& in);

struct ImprovedPatches {
  std::vector<mapping::Patch> patches;
  /// Figures before and after: under "unfold" and "relax" an array with an object for each patch.
  nlohmann::ordered_json figures = nlohmann::ordered_json::object();
};

/// Returns whether --untangle or --relax move particles.
[[nodiscard]] bool improvesPatches(const Invocation& in);

/// Untangles and relaxes patches of a base as the options request, and adds notes.
/// @param embedDepth  embedding depth, world units
/// @param textureSize  size of the texture's box
[[nodiscard]] ImprovedPatches improvedPatches(Invocation& in, const levelset::NarrowBand& base,
                                              std::vector<mapping::Patch> patches,
                                              double embedDepth, const Imath::V3d& textureSize);

/// Mean lengths of the rows and of the columns of particles on the surface, world units.
[[nodiscard]] std::array<double, 2> sidesOf(const mapping::Patch& patch);

[[nodiscard]] Param kernelParam();
[[nodiscard]] mapping::RbfKernel kernelOf(const Invocation& in);

void addDistortion(const mapping::Distortion& distortion, nlohmann::ordered_json& json);
[[nodiscard]] nlohmann::ordered_json certificateJson(const mapping::FoldCertificate& certificate);

}  // namespace pipeline
