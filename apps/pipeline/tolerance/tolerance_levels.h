#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/run/runner.h"
#include "apps/pipeline/tolerance/tolerance_graph.h"
#include "levelset/inspect/surface_difference.h"

namespace pipeline {

/// Surface of a result at one voxel size, for comparison.
struct LevelSurface {
  levelset::TriangleSurface surface = {};
  levelset::TriangleSurface uniform =
      {};                ///< uniform mesh of the level set that `surface` comes from; invalid: none
  double voxelSize = 0;  ///< voxel size of that level set or of the result, world units
  double diagonal = 0;   ///< diagonal of the bounding box, world units
  double heldEdge =
      0;  ///< width of the flat faces beside sharp edges of the source meshes, world units
};

/// A message of a run, kept until the search has chosen the best run.
struct Message {
  enum class Kind { Print, Warn, Note } kind = Kind::Note;
  std::string text;
};

/// Results of one run at one voxel size.
struct Level {
  double voxelSize = 0;
  std::vector<LevelSurface> surfaces;   ///< one per node of ToleranceParts::outputs
  std::map<std::size_t, Value> values;  ///< values of ToleranceParts::lasting, by node index
  RunReport report;
  std::vector<Message> messages;
  /// Message of a numeric check that failed, after which the run continued; empty: none.
  std::string failure;
  double peakBytes = 0;       ///< peak resident memory, bytes
  double voxels = 0;          ///< active voxels of all steps together
  std::size_t triangles = 0;  ///< triangles of all surfaces together
};

/// Difference between the surfaces of one result in a fine and in a coarse run.
struct LevelDifference {
  double smooth = 0, crease = 0, creaseShare = 0;  ///< as in levelset::SurfaceDifference
};

/// Runs the parts of a graph at several voxel sizes and compares their results.
class LevelRunner {
 public:
  LevelRunner(const Graph& graph, const ToleranceParts& parts, const RunSettings& settings);

  /// Computes the nodes of ToleranceParts::once. Appends the steps to `report`.
  void computeOnce(RunReport& report);
  /// Plans the complete graph with `resolution` voxels along the longest side of each object. Also
  /// checks the files that it will write.
  /// @return plans by node index
  [[nodiscard]] std::map<std::size_t, Value> planAll(int resolution, RunReport& report) const;
  /// Runs the nodes of ToleranceParts::again, with the values of computeOnce(), at the voxel size
  /// `voxel` times `coarsening`.
  /// @param voxel       voxel size of the nodes of ToleranceParts::chosen, world units
  /// @param coarsening  factor for all voxel sizes, including those that the user gave
  /// @throws levelset::Error as run()
  [[nodiscard]] Level runAt(double voxel, double coarsening);
  /// Plans the complete graph at a voxel size. Appends the steps to `report`.
  void planAt(double voxel, RunReport& report) const;
  /// Runs the nodes that write, draw, print and check, on the values of one run.
  void runEnds(const Level& level, RunReport& report) const;
  /// Measures the largest two-sided distance between a result and its source mesh at sample points,
  /// creases included. Faces of the mesh inside the solid count too, so the figure may be too
  /// large.
  /// @param output  index in ToleranceParts::outputs
  /// @return empty unless the result is a level set of a mesh, or a mesh of such a level set. Also
  ///         empty when the source mesh itself depends on voxel sizes
  [[nodiscard]] std::optional<double> knownError(const Level& level, std::size_t output);
  /// Compares one output of two runs.
  /// @param output  index in ToleranceParts::outputs
  [[nodiscard]] LevelDifference difference(const Level& fine, const Level& coarse,
                                           std::size_t output) const;

 private:
  [[nodiscard]] PartGraph repeatedAndEnds() const;
  [[nodiscard]] RunSettings settingsFor(const PartGraph& part) const;
  [[nodiscard]] LevelSurface surfaceOf(std::size_t output, const std::map<std::size_t, Value>& made,
                                       double voxel) const;

  const Graph& graph_;
  const ToleranceParts& parts_;
  const RunSettings& settings_;
  /// Nodes whose values are kept: outputs, their source meshes and level sets, `lasting`.
  std::vector<std::size_t> watched_;
  std::map<std::size_t, Value> once_;  ///< values of ToleranceParts::once, by node
  std::vector<std::size_t> meshes_;    ///< nodes of the meshes that are converted to level sets
  std::map<std::size_t, levelset::TriangleSurface>
      exact_;  ///< surfaces of those `meshes_` that do not depend on voxel sizes, by node
  bool hasCreases_ = false;  ///< an action other than `level-set` creates creases
};

}  // namespace pipeline
