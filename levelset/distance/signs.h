#pragma once

// Internal header of levelset: public headers must not include it.

#include <functional>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Sets ± background of `result` by the signs of `field`, but for the leaf blocks that `holds` says
/// are made by somebody else.
void copySigns(const openvdb::FloatTree& field,
               const std::function<bool(const openvdb::Coord& origin)>& holds,
               openvdb::FloatTree& result);

}  // namespace levelset::eikonal
