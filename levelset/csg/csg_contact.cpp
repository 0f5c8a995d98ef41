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

/// Returns true if a leaf pair may contain a grid point on or beside two faces that coincide: both
/// distances are nearly opposite there, and that of the second operand is below a voxel. Tests in
/// single precision, with a margin.
bool mayCoincide(const SharedLeaf& shared, const CsgSigns& signs, double voxelSize) {
  const float *a = shared.a->buffer().data(), *b = shared.b->buffer().data();
  const auto gap = static_cast<float>(3 * kGap * voxelSize), voxel = static_cast<float>(voxelSize);
  int found = 0;
  for (openvdb::Index n = 0; n < Leaf::SIZE; ++n)
    found |= static_cast<int>(std::abs(signs.first * a[n] + signs.second * b[n]) <= gap) &
             static_cast<int>(std::abs(b[n]) < voxel);
  return found != 0;
}

}  // namespace

std::vector<SharedLeaf> sharedLeaves(const FloatGrid& a, const FloatGrid& b) {
  std::vector<SharedLeaf> shared;
  const auto inA = a.getConstAccessor();
  for (auto leaf = b.tree().cbeginLeaf(); leaf; ++leaf)
    if (const Leaf* other = inA.probeConstLeaf(leaf->origin()))
      shared.push_back({other, leaf.getLeaf()});
  return shared;
}

Coincidence coincidenceOf(const FloatGrid& a, const FloatGrid& b, const CsgSigns& signs,
                          const std::vector<SharedLeaf>& shared) {
  struct Found {
    std::vector<Contact> contacts;
    bool hasFace = false;
  };
  std::vector<Found> found(shared.size());
  const double voxelSize = b.voxelSize()[0];
  const auto voxel = static_cast<float>(voxelSize), gap = static_cast<float>(kGap * voxelSize);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, shared.size(), 16), [&](const auto& range) {
    const SignedPair pair(a, b, signs);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      if (!mayCoincide(shared[i], signs, voxelSize)) continue;
      for (auto it = shared[i].b->cbeginValueOn(); it; ++it) {
        const float distance = std::abs(*it);
        double depth = 0;
        if (distance <= gap && isContact(pair, it.getCoord(), depth))
          found[i].contacts.push_back({it.getCoord(), depth});
        if (distance < voxel && !found[i].hasFace)
          found[i].hasFace = isBesideBoth(pair, it.getCoord());
      }
    }
  });
  Coincidence all;
  for (std::size_t i = 0; i < shared.size(); ++i) {
    all.contacts.insert(all.contacts.end(), found[i].contacts.begin(), found[i].contacts.end());
    if (found[i].hasFace) all.faces.push_back(shared[i].b->origin());
  }
  return all;
}

void closeContacts(FloatGrid& grid, const std::vector<Contact>& contacts, float sign) {
  auto accessor = grid.getAccessor();
  const double perVoxel = static_cast<double>(sign) * grid.voxelSize()[0];
  for (const Contact& contact : contacts)
    accessor.setValueOn(contact.at, static_cast<float>(perVoxel * contact.depth));
}

}  // namespace levelset
