#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetFilter.h>

#include "apps/regress/peers/peer.h"
#include "apps/regress/peers/peer_vdb.h"

namespace regress::peer {

using levelset::CsgOperation;
using levelset::NarrowBand;

NarrowBand offset(const NarrowBand& band, double distance) {
  const auto grid = levelset::vdb(band).deepCopy();
  openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
  filter.offset(static_cast<float>(-distance));
  return adopt(grid);
}

NarrowBand combine(CsgOperation operation, const NarrowBand& a, const NarrowBand& b) {
  const openvdb::FloatGrid &first = levelset::vdb(a), &second = levelset::vdb(b);
  switch (operation) {
    case CsgOperation::Union:
      return rebuild(adopt(openvdb::tools::csgUnionCopy(first, second)));
    case CsgOperation::Intersection:
      return rebuild(adopt(openvdb::tools::csgIntersectionCopy(first, second)));
    case CsgOperation::Difference:
      break;
  }
  return rebuild(adopt(openvdb::tools::csgDifferenceCopy(first, second)));
}

}  // namespace regress::peer
