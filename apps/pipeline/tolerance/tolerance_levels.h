#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/run/runner.h"
#include "apps/pipeline/tolerance/tolerance_graph.h"
#include "levelset/inspect/surface_difference.h"

namespace pipeline {

/// Surface of one output of a run with --tolerance, at one voxel size. The search compares it with
/// the surface at other voxel sizes.
struct LevelSurface {
  levelset::TriangleSurface surface = {};
  levelset::TriangleSurface uniform =
      {};  ///< mesh with uniform triangles of the level set behind `surface`; isValid() is false if
           ///< there is no such level set
  double voxelSize = 0;  ///< voxel size of that level set; without one, of the run; world units
  double diagonal = 0;   ///< diagonal of the bounding box, world units
  double heldEdge = 0;   ///< width of flat faces beside sharp edges, largest over the meshes that
                         ///< become level sets; world units
};

/// A message of a run, kept until the search for the voxel size has chosen the best run.
struct Message {
  enum class Kind { Print, Warn, Note } kind = Kind::Note;
  std::string text;
};

/// Results of one run at one voxel size.
struct Level {
  double voxelSize = 0;
  std::vector<LevelSurface> surfaces;   ///< one per node of ToleranceParts::outputs
  std::map<std::size_t, Value> values;  ///< values that nodes which write, draw or print will read,
                                        ///< or that no node reads; by node index
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
  /// `smooth`, `crease`: two-sided Hausdorff distances away from and near creases, world units.
  /// `creaseShare`: share of the sample points that lie near creases.
  double smooth = 0, crease = 0, creaseShare = 0;
};

/// Runs a graph at several voxel sizes and compares the surfaces of its outputs. ToleranceParts
/// lists the nodes that each run contains.
class LevelRunner {
 public:
  LevelRunner(const Graph& graph, const ToleranceParts& parts, const RunSettings& settings);

  /// Computes the nodes whose values do not depend on voxel sizes (ToleranceParts::once). Appends
  /// their steps to `report`.
  void computeOnce(RunReport& report);
  /// Plans the complete graph with `resolution` voxels along the longest side of each object. Also
  /// checks that the files which the graph writes can be created.
  /// @return plans by node index
  [[nodiscard]] std::map<std::size_t, Value> planAll(int resolution, RunReport& report) const;
  /// Runs the nodes that depend on voxel sizes (ToleranceParts::again) on the values of
  /// computeOnce(), at the voxel size `voxel` times `coarsening`.
  /// @param voxel       voxel size of the nodes whose voxel size the user left open, world units
  /// @param coarsening  factor for all voxel sizes, including those that the user gave
  /// @throws levelset::Error as run()
  [[nodiscard]] Level runAt(double voxel, double coarsening);
  /// Runs the complete graph at a voxel size in a dry run, which only plans. Appends the steps to
  /// `report`.
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
  /// Nodes whose values are kept after a run: outputs, the meshes and level sets from which they
  /// come, and ToleranceParts::lasting.
  std::vector<std::size_t> watched_;
  std::map<std::size_t, Value> once_;  ///< values that computeOnce() computed, by node index
  std::vector<std::size_t> meshes_;    ///< nodes of the meshes that are converted to level sets
  std::map<std::size_t, levelset::TriangleSurface>
      exact_;  ///< surfaces of those `meshes_` that do not depend on voxel sizes, by node
  bool hasCreases_ = false;  ///< an action other than `level-set` creates creases
};

}  // namespace pipeline
