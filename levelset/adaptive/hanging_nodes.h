#pragma once

// Internal header of levelset: public headers must not include it.

namespace levelset {

struct AdaptiveTree;

/// Makes the field of a tree continuous. A corner that lies on a face or an edge of a larger leaf
/// gets the interpolated value of that leaf [Sigg06, 3.4.1].
void constrainHangingNodes(AdaptiveTree& tree);

}  // namespace levelset
