#pragma once

#include "apps/pipeline/registry/operator.h"

namespace pipeline {

/// The action `effect`, which applies render::LookOptions and render::EffectOptions to a picture.
[[nodiscard]] Operator effectOperator();

}  // namespace pipeline
