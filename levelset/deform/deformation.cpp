#include "levelset/deform/deformation.h"

#include <fmt/core.h>

#include "levelset/deform/lattice_certificate.h"
#include "levelset/deform/lattice_inverse.h"
#include "levelset/error.h"

namespace levelset {
void LatticeDeformation::requireDefined(const std::vector<Imath::V3d>& points,
                                        const char* what) const {
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Imath::V3d& p = points[n];
    if (lattice_.contains(p)) continue;
    const Imath::V3d u = lattice_.parameterOf(p);
    throw InvalidInput(fmt::format(
        "{} {} at ({:.6g}, {:.6g}, {:.6g}) is outside the box of the lattice: its parameters are "
        "({:.4g}, {:.4g}, {:.4g}), but must be in [0, 1]; use a larger box",
        what, n, p.x, p.y, p.z, u.x, u.y, u.z));
  }
}

CertifiedDeformation LatticeDeformation::certify(const DeformationDomain&,
                                                 const CertifyOptions& options) const {
  CertifiedDeformation result{
      certifyLattice(lattice_, {.maxMemory = options.maxMemory, .progress = options.progress})};
  if (result.certificate.isInjective()) result.inverse = std::make_shared<LatticeInverse>(lattice_);
  return result;
}

}  // namespace levelset
