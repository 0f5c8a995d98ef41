#pragma once

#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"

namespace pipeline {

/// Returns true if the first operand is a terrain.
[[nodiscard]] bool isTerrain(const Invocation& in);

/// The action `measure` for a terrain.
[[nodiscard]] Value measureTerrain(Invocation& in);

/// Adds size, place, heights and coordinate system of a terrain to a JSON object.
void addTerrain(Json& json, const levelset::HeightField& terrain);

}  // namespace pipeline
