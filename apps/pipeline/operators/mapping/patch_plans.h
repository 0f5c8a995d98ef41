#pragma once

#include "apps/pipeline/registry/invocation.h"

/// Plans of the actions that build patches: bounds and patch size, before anything is computed.
namespace pipeline {

[[nodiscard]] Plan planPatch(Invocation& in);
[[nodiscard]] Plan planDecal(Invocation& in);
/// Plan of `patch-grid`. The patch size is that of a tile.
[[nodiscard]] Plan planGrid(Invocation& in);

}  // namespace pipeline
