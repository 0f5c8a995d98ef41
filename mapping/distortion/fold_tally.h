#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "mapping/distortion/fold_certificate.h"

namespace mapping {

/// Sorts folds by their Jacobian, the least first, and keeps the first kMostPoints.
inline void keepWorst(std::vector<FoldPoint>& places) {
  std::stable_sort(places.begin(), places.end(),
                   [](const FoldPoint& a, const FoldPoint& b) { return a.jacobian < b.jacobian; });
  places.resize(std::min(places.size(), FoldCertificate::kMostPoints));
}

/// Accumulates the results of the cells or cubes of a map, in order, into a certificate.
struct FoldTally {
  FoldCertificate certificate = {};

  void addVolume(double size, double folded, double undecided) {
    size_ += size, folded_ += folded, undecided_ += undecided;
  }
  /// Adds two determinants of a cell or cube.
  /// @param typical  typical determinant, for the median; ignored unless positive
  /// @param least    least determinant
  void addDeterminant(double typical, double least) {
    if (typical > 0) typical_.push_back(typical);
    least_ = std::min(least_, least);
  }
  void addFold(const FoldPoint& fold) { certificate.worst.push_back(fold); }

  /// Returns the certificate: determinants divided by the median of the positive ones, and the
  /// worst folds.
  [[nodiscard]] FoldCertificate finish() {
    double unit = 1;
    if (!typical_.empty()) {
      const auto middle = typical_.begin() + static_cast<std::ptrdiff_t>(typical_.size() / 2);
      std::nth_element(typical_.begin(), middle, typical_.end());
      unit = *middle;
    }
    std::vector<FoldPoint>& worst = certificate.worst;
    keepWorst(worst);
    for (FoldPoint& fold : worst) fold.jacobian /= unit;
    certificate.unit = unit;
    if (size_ > 0) {
      certificate.foldedShare = folded_ / size_;
      certificate.undecidedShare = undecided_ / size_;
    }
    certificate.leastJacobian = std::min(least_, std::numeric_limits<double>::max()) / unit;
    return std::move(certificate);
  }

 private:
  double size_ = 0, folded_ = 0, undecided_ = 0;
  double least_ = std::numeric_limits<double>::infinity();
  std::vector<double> typical_;
};

}  // namespace mapping
