#pragma once

#include "apps/viewer/viewer_arguments.h"

namespace viewer {

/// Runs the viewer without an open window: draws the picture until it is complete, prints the point
/// of --pick on standard output, and writes the file of --screenshot.
/// @throws levelset::Error when reading, drawing or writing fails
void runScript(const Arguments& arguments);

}  // namespace viewer
