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

// Certified, unfolded and relaxed patches, for the operators that map onto them.
namespace pipeline {

/// `params`, --unfold, --relax and --sides.
[[nodiscard]] std::vector<Param> withShell(std::vector<Param> params);
void validateShell(const Invocation& in);

struct ImprovedPatches {
  std::vector<mapping::Patch> patches;
  /// Before and after, an array with an object for each patch under "unfold" and "relax".
  nlohmann::ordered_json figures = nlohmann::ordered_json::object();
};

/// Do --unfold or --relax move particles?
[[nodiscard]] bool improvesPatches(const Invocation& in);

/// What --unfold and --relax make of patches of a base, told in the notes.
/// @param sink  world units; @param textureSize  of the box that is the unit cube
[[nodiscard]] ImprovedPatches improvedPatches(Invocation& in, const levelset::NarrowBand& base,
                                              std::vector<mapping::Patch> patches, double sink,
                                              const Imath::V3d& textureSize);

/// Mean lengths of the rows and of the columns of particles on the surface.
[[nodiscard]] std::array<double, 2> sidesOf(const mapping::Patch& patch);

[[nodiscard]] Param kernelParam();
[[nodiscard]] mapping::RbfKernel kernelOf(const Invocation& in);

void addDistortion(const mapping::Distortion& distortion, nlohmann::ordered_json& json);
[[nodiscard]] nlohmann::ordered_json certificateJson(const mapping::FoldCertificate& certificate);

}  // namespace pipeline
