#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "mapping/distortion/distortion.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/patches/patch.h"
#include "mapping/rbf/rbf_map.h"

// Options that untangle, relax and certify patches, for actions that map onto patches.
namespace pipeline {

/// Appends --untangle, --relax and --sides to `params`.
[[nodiscard]] std::vector<Param> withShell(std::vector<Param> params);
void validateShell(const Invocation& in);

struct ImprovedPatches {
  std::vector<mapping::Patch> patches;
  /// Figures before and after the improvement: "unfold" (of --untangle) and "relax" are arrays with
  /// an object for each patch. Null stands for a patch that was not relaxed.
  nlohmann::ordered_json figures = nlohmann::ordered_json::object();
};

/// Returns true if --untangle or --relax is given, so that particles move.
[[nodiscard]] bool improvesPatches(const Invocation& in);

/// Untangles and relaxes the patches of a base as the options request, and adds notes.
/// @param embedDepth  depth of the texture below the surface of the base, world units
/// @param textureSize  size of the texture's box, whose proportions --relax texture uses
[[nodiscard]] ImprovedPatches improvedPatches(Invocation& in, const levelset::NarrowBand& base,
                                              std::vector<mapping::Patch> patches,
                                              double embedDepth, const Imath::V3d& textureSize);

/// Returns the mean lengths of a patch on the surface along u and along v, world units.
[[nodiscard]] std::array<double, 2> sidesOf(const mapping::Patch& patch);

[[nodiscard]] Param kernelParam();
[[nodiscard]] Param supportParam();
[[nodiscard]] mapping::RbfKernel kernelOf(const Invocation& in);
/// @throws levelset::UsageError for options of RBF maps or of their kernels that have no effect
void validateKernel(const Invocation& in);

void addDistortion(const mapping::Distortion& distortion, nlohmann::ordered_json& json);
[[nodiscard]] nlohmann::ordered_json certificateJson(const mapping::FoldCertificate& certificate);

}  // namespace pipeline
