#pragma once

#include <Imath/ImathVec.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/regress/bounds.h"

/// Regression suite: problems with exact answers, run at several resolutions and at several
/// positions of the object relative to the grid points (placements).
namespace regress {

class Recorder;

/// Resolution and placement of one run of a problem. Objects have a size near one, so the voxel
/// size is 1 / resolution unless the case chooses another.
struct Sample {
  int resolution = 0;     ///< voxels per unit of length
  int phase = 0;          ///< index of the placement
  double voxelSize = 0;   ///< world units
  Imath::V3d shift = {};  ///< offset of the object from its position at placement 0, world units
};

/// Returns the placements: offsets of an object from the grid points, in voxels.
[[nodiscard]] const std::vector<Imath::V3d>& subVoxelPhases();

struct Case {
  std::string name = {};   ///< argument of --case
  std::string group = {};  ///< name of the plot that shows the case, such as "offset"; the cases of
                           ///< a group share one plot
  std::string title = {};  ///< description in one line
  std::string definition = {};  ///< computation, exact answer and meaning of the column value_error
  std::string citation = {};    ///< keys of REFERENCES.md, or the kind of the exact answer
  std::vector<int> quick = {}, full = {};  ///< resolutions; empty for cases with outcomes only
  std::vector<Bound> bounds = {};
  std::function<void(Recorder&)> run = {};
};

/// Builds a case that states outcomes only and has no rows of figures.
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
void addPointCases(std::vector<Case>& all);
void addOffsetCases(std::vector<Case>& all);
void addCsgCases(std::vector<Case>& all);
void addEmbossCases(std::vector<Case>& all);
void addMorphologyCases(std::vector<Case>& all);
void addFilletCases(std::vector<Case>& all);
void addEikonalCases(std::vector<Case>& all);
void addCurvatureCases(std::vector<Case>& all);
void addSmoothCases(std::vector<Case>& all);
void addAdvectionCases(std::vector<Case>& all);
void addMorphCases(std::vector<Case>& all);
void addResampleCases(std::vector<Case>& all);
void addKalbeCases(std::vector<Case>& all);
void addLookupCases(std::vector<Case>& all);
void addExtremeCases(std::vector<Case>& all);
void addBadInputCases(std::vector<Case>& all);

using Figures = std::map<std::string, double>;

/// Figures of one run of one tool, or the summary of its runs at all placements.
struct Row {
  std::string variant, tool;
  int resolution = 0;
  int phase = 0;             ///< index of the placement; -1 in a summary
  Figures figures = {};      ///< figures by the name of their column; only those that were measured
  std::string failure = {};  ///< reason why the row has no figures
};

/// Statement about the result of a run, and its verification.
struct Outcome {
  std::string variant;
  std::string expected;
  std::string found;
  bool passed = false;
};

/// Bound of a case, the figure found, and the result of the comparison.
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
  std::vector<Row>
      summary;  ///< worst figures of all placements, for each variant, tool and resolution
  std::vector<Outcome> outcomes;
  std::vector<Judgement> judgements;
  double cpuSeconds = 0;  ///< CPU time of the case including the measurement of the errors, seconds
};

}  // namespace regress
