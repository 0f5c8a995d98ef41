#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/run/runner.h"
#include "apps/pipeline/tolerance/tolerance_graph.h"
#include "levelset/inspect/surface_difference.h"

namespace pipeline {

/// A result at one voxel size, ready to be compared.
struct LevelSurface {
  levelset::TriangleSurface surface = {};
  levelset::TriangleSurface uniform = {};  ///< of the level set that a mesh was made from, if any
  double voxelSize = 0;                    ///< of that level set, or of the result
  double diagonal = 0;                     ///< of its bounding box
  double heldEdge = 0;  ///< world units: how far from an edge meshes that it is made of are flat
};

/// Something that a run told, kept until it is known to be the one that counts.
struct Told {
  enum class Kind { Print, Warn, Note } kind = Kind::Note;
  std::string text;
};

/// One run of what is made again and again.
struct Level {
  double voxelSize = 0;
  std::vector<LevelSurface> surfaces;   ///< by output
  std::map<std::size_t, Value> values;  ///< that last, by number of node
  RunReport report;
  std::vector<Told> told;
  std::string failure;   ///< a check that a step did not pass, and went on
  double peakBytes = 0;  ///< of the resident set
  double voxels = 0;     ///< active ones of all its steps
  std::size_t triangles = 0;
};

/// How far the result of `fine` is from that of `coarse`.
struct LevelDifference {
  double smooth = 0, crease = 0, creaseShare = 0;  ///< as of levelset::SurfaceDifference
};

/// Runs the parts of a graph at voxel sizes, and compares what comes of it.
class LevelRunner {
 public:
  LevelRunner(const Graph& graph, const ToleranceParts& parts, const RunSettings& settings);

  /// Makes what no voxel size has a part in. Its steps go into `report`.
  void makeOnce(RunReport& report);
  /// Plans the whole graph with that many voxels along the longest side of each object: checks what
  /// it will write, too. @return by node
  [[nodiscard]] std::map<std::size_t, Value> planAll(int resolution, RunReport& report) const;
  /// @param coarsening  of the voxels that were given
  /// @throws as run()
  [[nodiscard]] Level runAt(double voxel, double coarsening);
  /// Plans the whole graph at a voxel size.
  void planAt(double voxel, RunReport& report) const;
  /// Runs what writes, draws, prints and checks, on the values of a level.
  void runEnds(const Level& level, RunReport& report) const;
  /// @param output  its number among ToleranceParts::outputs
  /// How far the result is from the mesh that it stands for, where it is a level set of a mesh, or
  /// a mesh of that: the largest distance from each to the other, creases included. What of the
  /// mesh is inside the solid counts too, so that it may be too large, never too small.
  [[nodiscard]] std::optional<double> knownError(const Level& level, std::size_t output);
  [[nodiscard]] LevelDifference difference(const Level& fine, const Level& coarse,
                                           std::size_t output) const;

 private:
  [[nodiscard]] PartGraph whole() const;
  [[nodiscard]] RunSettings settingsFor(const PartGraph& part) const;
  [[nodiscard]] LevelSurface surfaceOf(std::size_t output, const std::map<std::size_t, Value>& made,
                                       double voxel) const;

  const Graph& graph_;
  const ToleranceParts& parts_;
  const RunSettings& settings_;
  std::vector<std::size_t> watched_;  ///< values that are looked at: outputs, what they came from
  std::map<std::size_t, Value> once_;
  std::vector<std::size_t> meshes_;                         ///< that level sets are made of
  std::map<std::size_t, levelset::TriangleSurface> exact_;  ///< of those, where no voxel had a part
  bool hasCreases_ = false;  ///< does an action make them, other than `level-set`?
};

}  // namespace pipeline
