#pragma once

#include <Imath/ImathVec.h>

#include <functional>

namespace levelset {

/// A number at each point of space (world units), or a vector at each point and time. The source is
/// a constant, an expression or a grid. Several threads may call it at once.
using ScalarField = std::function<double(const Imath::V3d& world)>;
using VectorField = std::function<Imath::V3d(const Imath::V3d& world, double time)>;

}  // namespace levelset
