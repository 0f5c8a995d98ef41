#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/csg/csg_vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3d;
using Leaf = openvdb::FloatTree::LeafNodeType;

/// Largest gap between two faces that counts as closed, voxels. Rounding leaves such gaps between
/// touching faces.
constexpr double kGap = 1e-3;

/// Grid point between two touching faces.
struct Contact {
  Coord at;
  double depth;  ///< distance of the least deep inside neighbour, voxels, negative
};

/// Reads the distances of both operands in voxels, multiplied by their signs ±1 of CsgSigns.
struct SignedPair {
  FloatGrid::ConstAccessor a, b;
  double first, second;

  SignedPair(const FloatGrid& gridA, const FloatGrid& gridB, const CsgSigns& signs)
      : a(gridA.getConstAccessor()),
        b(gridB.getConstAccessor()),
        first(static_cast<double>(signs.first) / gridA.voxelSize()[0]),
        second(static_cast<double>(signs.second) / gridB.voxelSize()[0]) {}

  [[nodiscard]] double u(const Coord& c) const {
    return first * static_cast<double>(a.getValue(c));
  }
  [[nodiscard]] double v(const Coord& c) const {
    return second * static_cast<double>(b.getValue(c));
  }
  [[nodiscard]] double least(const Coord& c) const { return std::min(u(c), v(c)); }
  /// Returns true if a grid point is on both surfaces and inside neither solid.
  [[nodiscard]] bool isOnBoth(const Coord& c) const {
    return least(c) >= 0 && std::max(u(c), v(c)) <= kGap;
  }
};

Coord stepped(Coord c, int axis, int step) {
  c[axis] += step;
  return c;
}

/// Returns true if a grid point is between two touching faces. The gradients of both distances are
/// opposite there, and along one axis both neighbours are inside a solid. Along every other axis
/// the face continues, so two spheres that touch in a point stay separate. Sets `depth`, see
/// Contact.
bool isContact(const SignedPair& pair, const Coord& c, double& depth) {
  if (!pair.isOnBoth(c)) return false;
  Vec3d slopeU, slopeV;
  depth = -std::numeric_limits<double>::max();
  int through = 0;  // number of axes with both neighbours inside
  for (int axis = 0; axis < 3; ++axis) {
    const Coord up = stepped(c, axis, 1), down = stepped(c, axis, -1);
    slopeU[axis] = pair.u(up) - pair.u(down);
    slopeV[axis] = pair.v(up) - pair.v(down);
    const bool isInsideUp = pair.least(up) < 0, isInsideDown = pair.least(down) < 0;
    if (isInsideUp && isInsideDown) {
      ++through;
      depth = std::max({depth, pair.least(up), pair.least(down)});
    } else if (!isInsideUp && !isInsideDown && !pair.isOnBoth(up) && !pair.isOnBoth(down)) {
      return false;
    }
  }
  return through > 0 && slopeU.dot(slopeV) < -0.5 * slopeU.length() * slopeV.length();
}

std::vector<Contact> findContacts(const FloatGrid& a, const FloatGrid& b, const CsgSigns& signs) {
  std::vector<const Leaf*> shared;
  for (auto leaf = b.tree().cbeginLeaf(); leaf; ++leaf)
    if (a.tree().probeConstLeaf(leaf->origin())) shared.push_back(leaf.getLeaf());
  const auto gap = static_cast<float>(kGap * b.voxelSize()[0]);
  std::vector<std::vector<Contact>> found(shared.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, shared.size(), 16), [&](const auto& range) {
    const SignedPair pair(a, b, signs);
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      for (auto it = shared[i]->cbeginValueOn(); it; ++it) {
        if (std::abs(*it) > gap) continue;
        double depth = 0;
        if (isContact(pair, it.getCoord(), depth)) found[i].push_back({it.getCoord(), depth});
      }
  });
  std::vector<Contact> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return all;
}

FloatGrid::Ptr withContacts(const FloatGrid& grid, const std::vector<Contact>& contacts,
                            float sign) {
  FloatGrid::Ptr result = grid.deepCopy();
  auto accessor = result->getAccessor();
  const double perVoxel = static_cast<double>(sign) * grid.voxelSize()[0];
  for (const Contact& contact : contacts)
    accessor.setValueOn(contact.at, static_cast<float>(perVoxel * contact.depth));
  return result;
}

/// Returns true if a grid point is next to a face that both operands share with opposite
/// orientation, and if that face continues around the point. Round solids that touch in a point
/// have opposite gradients too, but only on the line through the contact.
bool isBesideBoth(const SignedPair& pair, const Coord& c) {
  const auto isOpposite = [&](const Coord& at) {
    return std::abs(pair.u(at) + pair.v(at)) <= kGap;
  };
  if (!isOpposite(c)) return false;
  int continued = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const int step : {-2, 2}) continued += isOpposite(stepped(c, axis, step)) ? 1 : 0;
  if (continued < 3) return false;
  Vec3d slopeU, slopeV;
  for (int axis = 0; axis < 3; ++axis) {
    const Coord up = stepped(c, axis, 1), down = stepped(c, axis, -1);
    slopeU[axis] = pair.u(up) - pair.u(down);
    slopeV[axis] = pair.v(up) - pair.v(down);
  }
  // slopeU and slopeV are differences over two voxels: of length 2 on a face, and shorter at edges.
  return slopeU.length() > 1.8 && slopeV.length() > 1.8 &&
         slopeU.dot(slopeV) < -0.999 * slopeU.length() * slopeV.length();
}

}  // namespace

std::vector<Coord> coincidentFaces(const FloatGrid& a, const FloatGrid& b, const CsgSigns& signs) {
  std::vector<const Leaf*> shared;
  for (auto leaf = b.tree().cbeginLeaf(); leaf; ++leaf)
    if (a.tree().probeConstLeaf(leaf->origin())) shared.push_back(leaf.getLeaf());
  std::vector<char> found(shared.size(), 0);
  const auto voxel = static_cast<float>(b.voxelSize()[0]);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, shared.size(), 16), [&](const auto& range) {
    const SignedPair pair(a, b, signs);
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      for (auto it = shared[i]->cbeginValueOn(); it && !found[i]; ++it)
        if (std::abs(*it) < voxel && isBesideBoth(pair, it.getCoord())) found[i] = 1;
  });
  std::vector<Coord> leaves;
  for (std::size_t i = 0; i < shared.size(); ++i)
    if (found[i]) leaves.push_back(shared[i]->origin());
  return leaves;
}

std::optional<ClosedPair> closeContacts(const FloatGrid& a, const FloatGrid& b,
                                        const CsgSigns& signs) {
  const std::vector<Contact> contacts = findContacts(a, b, signs);
  if (contacts.empty()) return std::nullopt;
  return ClosedPair{withContacts(a, contacts, signs.first),
                    withContacts(b, contacts, signs.second)};
}

}  // namespace levelset
