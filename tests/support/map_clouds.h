#pragma once

#include "mapping/rbf/rbf_map.h"
#include "tests/support/clouds.h"

namespace support {

/// @param options  all options except λ
inline mapping::RbfMap fit(const Cloud& cloud, double lambda, mapping::RbfMapOptions options = {}) {
  options.lambdaNear = options.lambdaFar = lambda;
  return {cloud.points, cloud.targets, cloud.near, options};
}
inline mapping::RbfMap fit(const Cloud& cloud, double lambda, levelset::rbf::RbfKernel kernel) {
  return fit(cloud, lambda, mapping::RbfMapOptions{.kernel = kernel});
}

}  // namespace support
