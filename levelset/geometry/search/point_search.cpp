#include "levelset/geometry/search/point_search.h"

namespace levelset {

template class OverlapTree<PointItem>;

}  // namespace levelset
