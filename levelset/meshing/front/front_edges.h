#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "levelset/meshing/front/item_octree.h"

namespace levelset {

/// Edge of a front. The part of the surface without triangles lies to its left, as seen from
/// outside.
struct FrontEdge {
  std::uint32_t a = 0, b = 0;        ///< vertices
  std::uint32_t prev = 0, next = 0;  ///< edges of the same loop
  bool isActive = false;
  int level = 0;         ///< number of failed tries
  bool isStuck = false;  ///< all tries failed
  bool isFinal = false;  ///< on a border of the surface
};

/// The loops of a front, and an octree for the edges near a position. Deterministic.
class FrontEdges {
 public:
  /// @param longest  at least the length of the longest edges
  explicit FrontEdges(double longest) : tree_(longest) {}

  [[nodiscard]] const FrontEdge& operator[](std::uint32_t edge) const { return edges_[edge]; }
  [[nodiscard]] std::size_t count() const { return edges_.size(); }
  [[nodiscard]] std::size_t activeCount() const { return active_; }

  void setLevel(std::uint32_t edge, int level) { edges_[edge].level = level; }
  void setFinal(std::uint32_t edge) { edges_[edge].isFinal = true; }
  void setStuck(std::uint32_t edge, bool isStuck) { edges_[edge].isStuck = isStuck; }

  /// Adds an edge that is not linked yet.
  std::uint32_t add(std::uint32_t a, std::uint32_t b, const Imath::V3d& from, const Imath::V3d& to);
  void link(std::uint32_t edge, std::uint32_t next) {
    edges_[edge].next = next;
    edges_[next].prev = edge;
  }
  void remove(std::uint32_t edge);

  /// Appends the edges near a position, at least those that come within `radius`.
  void near(const Imath::V3d& position, double radius, std::vector<std::uint32_t>& found) const;

  /// Marks a directed edge as the side of a triangle.
  void use(std::uint32_t a, std::uint32_t b) { used_.insert(key(a, b)); }
  [[nodiscard]] bool isUsed(std::uint32_t a, std::uint32_t b) const {
    return used_.contains(key(a, b));
  }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint64_t>(a) << 32 | b;
  }

  /// Middle and length of an edge.
  struct Place {
    Imath::V3d middle;
    double length;
  };

  std::vector<FrontEdge> edges_;
  std::vector<Place> places_;
  ItemOctree tree_;  ///< edges by middle and length
  std::unordered_set<std::uint64_t> used_;
  std::size_t active_ = 0;
};

}  // namespace levelset
