#pragma once

#include <Imath/ImathVec.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/regress/bounds.h"

/// Regression suite: problems with exact answers, run at several resolutions and placements on the
/// grid.
namespace regress {

class Recorder;

/// One run of a problem. The object has a size near one. The voxel size is 1 / resolution.
struct Sample {
  int resolution = 0;     ///< voxels per unit of length
  int phase = 0;          ///< index of the placement
  double voxelSize = 0;   ///< world units
  Imath::V3d shift = {};  ///< offset of the object from the grid points, world units
};

/// Placements of an object between the grid points, in voxels.
[[nodiscard]] const std::vector<Imath::V3d>& subVoxelPhases();

struct Case {
  std::string name = {};                   ///< argument of --case
  std::string group = {};                  ///< operator; each group has one plot
  std::string title = {};                  ///< one line
  std::string definition = {};             ///< computation and exact answer
  std::string citation = {};               ///< keys of REFERENCES.md
  std::vector<int> quick = {}, full = {};  ///< resolutions; empty for cases with outcomes only
  std::vector<Bound> bounds = {};
  std::function<void(Recorder&)> run = {};
};

/// Builds a case without rows of figures, which states outcomes only.
[[nodiscard]] inline Case statedCase(const char* name, const char* title, const char* definition,
                                     const char* citation, void (*run)(Recorder&)) {
  return {.name = name,
          .group = name,
          .title = title,
          .definition = definition,
          .citation = citation,
          .run = run};
}

/// All cases, in the order of the run.
[[nodiscard]] const std::vector<Case>& cases();

// Each function adds the cases of one file of apps/regress/cases/.
void addShapeCases(std::vector<Case>& all);
void addMeshCases(std::vector<Case>& all);
void addRedistanceCases(std::vector<Case>& all);
void addOffsetCases(std::vector<Case>& all);
void addCsgCases(std::vector<Case>& all);
void addMorphologyCases(std::vector<Case>& all);
void addFilletCases(std::vector<Case>& all);
void addEikonalCases(std::vector<Case>& all);
void addCurvatureCases(std::vector<Case>& all);
void addSmoothCases(std::vector<Case>& all);
void addAdvectionCases(std::vector<Case>& all);
void addMorphCases(std::vector<Case>& all);
void addResampleCases(std::vector<Case>& all);
void addExtremeCases(std::vector<Case>& all);
void addBadInputCases(std::vector<Case>& all);

using Figures = std::map<std::string, double>;

/// One run of one tool.
struct Row {
  std::string variant, tool;
  int resolution = 0;
  int phase = 0;             ///< index of the placement; -1 in a summary
  Figures figures = {};      ///< by column, measured ones only
  std::string failure = {};  ///< reason why the row has no figures
};

/// Statement of a case and its verification.
struct Outcome {
  std::string variant;
  std::string expected;
  std::string found;
  bool passed = false;
};

/// Bound and the figure found.
struct Judgement {
  Bound bound;
  int resolution = 0;
  double found = 0;
  bool passed = false;
  std::string remark = {};
};

struct CaseResult {
  const Case* of = nullptr;
  std::vector<Row> rows;
  std::vector<Row> summary;  ///< worst placement, by variant, tool and resolution
  std::vector<Outcome> outcomes;
  std::vector<Judgement> judgements;
  double cpuSeconds = 0;  ///< measurements included
};

}  // namespace regress
