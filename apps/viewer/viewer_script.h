#pragma once

#include "apps/viewer/viewer_arguments.h"

namespace viewer {

/// Draws the requested picture in an invisible window until it is complete. Prints the picked point
/// on standard output and writes the screenshot.
/// @throws levelset::Error as reading, drawing and writing do
void runScript(const Arguments& arguments);

}  // namespace viewer
