#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "apps/cli/watch.h"
#include "apps/viewer/viewer.h"
#include "apps/viewer/viewer_arguments.h"
#include "apps/viewer/viewer_script.h"
#include "apps/viewer/window.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace {

using levelset::ExitCode;

/// Prints a sentence on standard error. Puts the name of the program in front of it, unless the
/// sentence starts with that name.
void printMessage(const std::string& sentence) {
  constexpr const char* kName = "levelsmith-view: ";
  fmt::print(stderr, "{}{}\n", sentence.starts_with(kName) ? "" : kName, sentence);
}

void runWindow(const viewer::Arguments& arguments) {
  // Check the files before the window opens, so that an error ends the program.
  viewer::requireReadable(arguments.files);
  viewer::Window window("Levelsmith", arguments.width, arguments.height, true);
  viewer::Viewer viewer(arguments, window);
  if (!arguments.files.empty()) viewer.open(arguments.files);
  // Longest wait for an event, seconds; then changed files are looked for.
  constexpr double kIdle = 0.25;
  constexpr double kAfterEvent = 0.02;
  constexpr int kFramesAfterEvent = 3;  // frames that ImGui needs until its layout is final
  int frames = kFramesAfterEvent;
  while (!window.isToClose()) {
    const int width = window.width(), height = window.height();
    viewer.update();
    window.draw([&] { viewer.drawInterface(width, height); });
    viewer.requestPicture(width, height);
    viewer.writeInterfaceShot();
    const bool isSettled = --frames <= 0 && !viewer.isBusy();
    if (window.wait(isSettled ? kIdle : kAfterEvent)) frames = kFramesAfterEvent;
  }
  if (const std::string kept = viewer.keepUnsavedStrokes(); !kept.empty()) printMessage(kept);
}

int levelsmithView(const std::vector<std::string>& words) {
  const viewer::Arguments arguments = viewer::parseArguments(words);
  if (arguments.asksHelp || arguments.asksVersion) {
    const std::string text =
        arguments.asksHelp ? viewer::viewerHelp() : "levelsmith-view " LEVELSMITH_VERSION "\n";
    std::fputs(text.c_str(), stdout);
    return static_cast<int>(ExitCode::Done);
  }
  cli::startWatch(levelset::kNoMemoryLimit);
  if (arguments.isScript())
    viewer::runScript(arguments);
  else
    runWindow(arguments);
  return static_cast<int>(ExitCode::Done);
}

/// Prints the message of an error. @return the exit code of the program
int printFailure(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const levelset::Error& error) {
    printMessage(error.what());
    return static_cast<int>(error.exitCode());
  } catch (const std::bad_alloc&) {
    printMessage("memory ran out; open a smaller model, or use a smaller --resolution");
    return static_cast<int>(ExitCode::Resource);
  } catch (const std::exception& error) {
    printMessage(fmt::format(
        "unexpected failure: {}; please report it with the command that caused it", error.what()));
  }
  return static_cast<int>(ExitCode::Input);
}

}  // namespace

int main(int argc, char** argv) {
  int code = 0;
  try {
    code = levelsmithView({argv + 1, argv + argc});
  } catch (...) {
    code = printFailure(std::current_exception());
  }
  std::fflush(stderr);
  levelset::removeTemporaryFiles();
  // Other threads may still run, so destructors are skipped.
  if (std::fflush(stdout) != 0 && code == 0) code = static_cast<int>(ExitCode::File);
  _exit(code);
}
