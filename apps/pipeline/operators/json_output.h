#pragma once

// What actions that tell figures share: one JSON object on standard output with --json.

#include <nlohmann/json.hpp>
#include <string>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"

namespace pipeline {

using Json = nlohmann::ordered_json;

/// File and grid names may be of any bytes.
inline std::string printed(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

inline bool asksJson(const Invocation& in) {
  return in.flag("json");
}

inline Param jsonParam() {
  return {.name = "json", .type = ParamType::Flag, .doc = "one JSON object on standard output"};
}

}  // namespace pipeline
