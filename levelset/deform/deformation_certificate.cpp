#include "levelset/deform/deformation_certificate.h"

#include <fmt/core.h>

#include "levelset/error.h"

namespace levelset {
namespace {

std::string foldPlace(const Imath::V3d& p) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x, p.y, p.z);
}

}  // namespace

FoldVerdict verdictOf(double low, double high) {
  if (high <= 0) return FoldVerdict::Folds;
  return low > 0 ? FoldVerdict::Certified : FoldVerdict::Undecided;
}

const char* foldVerdictName(FoldVerdict verdict) {
  switch (verdict) {
    case FoldVerdict::Certified:
      return "certified";
    case FoldVerdict::Folds:
      return "folds";
    case FoldVerdict::Undecided:
      break;
  }
  return "undecided";
}

std::string describe(const FoldCertificate& certificate) {
  return fmt::format("least Jacobian {:.4g} to {:.4g} at {}: {}{}", certificate.leastLow,
                     certificate.leastHigh, foldPlace(certificate.place),
                     foldVerdictName(certificate.verdict),
                     certificate.overlaps ? ", but the deformed surface overlaps itself" : "");
}

void requireInjective(const FoldCertificate& certificate) {
  const bool isLattice = certificate.subject == std::string("lattice");
  if (certificate.verdict == FoldVerdict::Folds)
    throw InvalidInput(fmt::format(
        "the {} folds: its Jacobian is {:.3g} at {}; deform less, {}", certificate.subject,
        certificate.leastHigh, foldPlace(certificate.place),
        isLattice ? "or use a smaller box" : "or move the vertices near that point back"));
  if (certificate.verdict == FoldVerdict::Undecided && certificate.isNearCage)
    throw InvalidInput(fmt::format(
        "the surface comes too close to the cage or leaves it near {}, so a fold is not excluded; "
        "use a larger cage, or smaller voxels",
        foldPlace(certificate.place)));
  if (certificate.verdict == FoldVerdict::Undecided)
    throw InvalidInput(fmt::format(
        "the least Jacobian of the {} is between {:.3g} and {:.3g}, near {}, so a fold is not "
        "excluded; deform less, {}",
        certificate.subject, certificate.leastLow, certificate.leastHigh,
        foldPlace(certificate.place),
        isLattice ? "or use lower degrees" : "or use a cage with more room around the surface"));
  if (certificate.overlaps)
    throw InvalidInput(fmt::format("the deformed {} overlaps itself near {}; deform less{}",
                                   isLattice ? "box of the lattice" : "surface",
                                   foldPlace(certificate.overlapPlace),
                                   isLattice ? ", or use a smaller box" : ""));
}

}  // namespace levelset
