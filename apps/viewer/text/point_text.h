#pragma once

#include <Imath/ImathVec.h>

#include <string>

namespace viewer {

/// Formats a point as "x,y,z", the form of the command line, with eight significant digits.
[[nodiscard]] std::string pointText(const Imath::V3d& point);

/// Rounds a number, or the coordinates of a point, to the eight digits of pointText(). So the
/// command line reads back the same bits.
[[nodiscard]] double asWritten(double number);
[[nodiscard]] Imath::V3d asWritten(const Imath::V3d& point);

}  // namespace viewer
