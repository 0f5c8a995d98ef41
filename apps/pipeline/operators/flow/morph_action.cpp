#include "apps/pipeline/operators/flow/morph_action.h"

#include <fmt/core.h>

#include "apps/pipeline/grammar/file_sequence.h"
#include "apps/pipeline/operators/level_set_operator.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/morph/morph.h"

namespace pipeline {
namespace {

FileSequence stepSequence(const Invocation& in) {
  const std::string pattern = in.text("keep-steps");
  FileSequence sequence(pattern);
  if (!sequence.hasNumber() || !levelset::isBandFormat(pattern))
    throw levelset::UsageError(
        fmt::format("{}: '{}' is not a sequence of .vdb files; write # for the number, as in "
                    "step_###.vdb",
                    in.where("keep-steps"), pattern));
  return sequence;
}

/// Returns the names of all files that --keep-steps may write; empty without the option.
std::vector<std::string> stepFiles(const Invocation& in) {
  std::vector<std::string> files;
  if (!in.given("keep-steps")) return files;
  const FileSequence sequence = stepSequence(in);
  const auto steps = static_cast<std::size_t>(in.integer("steps"));
  for (std::size_t i = 1; i <= steps; ++i) files.push_back(sequence.file(i).string());
  return files;
}

void keepSteps(levelset::MorphOperator::Options& options, Invocation& in) {
  if (!in.given("keep-steps")) return;
  options.keep = [sequence = stepSequence(in)](const levelset::NarrowBand& step, int number) {
    levelset::writeBand(sequence.file(static_cast<std::size_t>(number)), step);
  };
}

}  // namespace

Operator morphOperator() {
  return levelSetOperator<levelset::MorphOperator>(
      {.params = {{.name = "keep-steps",
                   .type = ParamType::Path,
                   .doc = "write the band after each step to a .vdb file; # in the name stands for "
                          "the number of the step, as in step_###.vdb"}},
       .validate =
           [](const Invocation& in) {
             if (in.given("keep-steps")) (void)stepSequence(in);
           },
       .targets = stepFiles,
       .prepare = keepSteps});
}

}  // namespace pipeline
