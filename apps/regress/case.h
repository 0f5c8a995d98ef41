#pragma once

#include <Imath/ImathVec.h>

#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/regress/truth/truth.h"

/// The regression suite: problems with exact answers, run at several resolutions and placements on
/// the grid.
namespace regress {

class Recorder;

enum class Budget { Quick, Full };

/// One run of a problem. The object has a size near one; the voxel size is 1 / resolution.
struct Sample {
  int resolution = 0;     ///< voxels per unit of length
  int phase = 0;          ///< which of the placements
  double voxelSize = 0;   ///< world units
  Imath::V3d shift = {};  ///< by which the object lies off the grid points, world units
};

/// Placements of an object between the grid points, in voxels.
[[nodiscard]] const std::vector<Imath::V3d>& subVoxelPhases();

enum class Sense { AtMost, AtLeast };

/// What must hold of a figure of ours, in the worst placement.
struct Bound {
  std::string variant;
  std::string figure;  ///< a column, see columns.h
  double limit = 0;
  int resolution = 0;  ///< 0: at every one
  Sense sense = Sense::AtMost;
};

/// Most of the zeros along rays that may be missing or too many where a surface is bounded. Not
/// none: of the rays that hit a ball of radius R, 2 e / R pass so near to its rim that an error of
/// e decides whether they do; R = 3 voxels and e = 0.03 make two of a hundred.
inline constexpr double kMostMissed = 0.025;

/// Rays that pass an edge within a part of a voxel may go either way, too, and so may those through
/// what is as thin as that. Their share falls with the voxel: bounds in the place of kMostMissed,
/// at these resolutions.
/// @param atOne  the share with one voxel per unit of length
inline void allowAtEdges(std::vector<Bound>& bounds, const std::string& variant, double atOne,
                         std::initializer_list<int> resolutions) {
  for (const int resolution : resolutions)
    bounds.push_back({variant, "missed_hits", atOne / resolution, resolution});
}

struct Case {
  std::string name = {};        ///< as --case takes it
  std::string group = {};       ///< operator: the plots are made by it
  std::string title = {};       ///< one line
  std::string definition = {};  ///< what is computed and what the answer is
  std::string citation = {};    ///< keys of REFERENCES.md
  std::vector<int> quick = {},
                   full = {};  ///< resolutions; empty for cases that only state outcomes
  std::vector<Bound> bounds = {};
  std::function<void(Recorder&)> run = {};
};

/// A case without rows of figures, which only states outcomes.
[[nodiscard]] inline Case statedCase(const char* name, const char* title, const char* definition,
                                     const char* citation, void (*run)(Recorder&)) {
  return {.name = name,
          .group = name,
          .title = title,
          .definition = definition,
          .citation = citation,
          .run = run};
}

/// All cases, in the order in which they run.
[[nodiscard]] const std::vector<Case>& cases();

// Each fills its group; see apps/regress/cases/.
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
  int phase = 0;             ///< -1 in a summary: all of them
  Figures figures = {};      ///< by column; what was not measured is missing
  std::string failure = {};  ///< why there are none
};

/// A statement that holds or not.
struct Outcome {
  std::string variant;
  std::string expected;
  std::string found;
  bool passed = false;
};

/// A bound and what came out.
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
  double cpuSeconds = 0;  ///< with all measuring
};

}  // namespace regress
