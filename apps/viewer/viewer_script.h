#pragma once

#include "apps/viewer/viewer_arguments.h"

namespace viewer {

/// Draws what the arguments ask for until it is finished, in a window that nobody sees; prints what
/// is picked on standard output, and writes the screenshot.
/// @throws what reading, drawing and writing do
void runScript(const Arguments& arguments);

}  // namespace viewer
