#include "apps/viewer/text/point_text.h"

#include <fmt/core.h>

#include <cstdlib>

namespace viewer {
namespace {

/// Eight significant digits, about the precision of single-precision positions. Negative zero
/// becomes zero.
std::string digitsOf(double x) {
  return fmt::format("{:.8g}", x == 0 ? 0 : x);
}

}  // namespace

std::string pointText(const Imath::V3d& point) {
  return fmt::format("{},{},{}", digitsOf(point.x), digitsOf(point.y), digitsOf(point.z));
}

double asWritten(double number) {
  return std::strtod(digitsOf(number).c_str(), nullptr);
}

Imath::V3d asWritten(const Imath::V3d& point) {
  return {asWritten(point.x), asWritten(point.y), asWritten(point.z)};
}

}  // namespace viewer
