#pragma once

// Output of figures: with --json, one JSON object on standard output.

#include <nlohmann/json.hpp>
#include <string>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"

namespace pipeline {

using Json = nlohmann::ordered_json;

/// Formats JSON for output. Names of files and grids may contain any bytes, so invalid UTF-8 is
/// replaced.
inline std::string printed(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

inline bool asksJson(const Invocation& in) {
  return in.flag("json");
}

inline Param jsonParam() {
  return {.name = "json",
          .type = ParamType::Flag,
          .doc = "print the results as one JSON object on standard output"};
}

/// Array of the coordinates.
[[nodiscard]] inline Json toJson(const Imath::V3d& v) {
  return Json::array({v.x, v.y, v.z});
}
/// Corners of a box; null if it is empty.
[[nodiscard]] inline Json toJson(const Imath::Box3d& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", toJson(box.min)}, {"max", toJson(box.max)}};
}

}  // namespace pipeline
