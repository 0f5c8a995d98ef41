#pragma once

#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "apps/viewer/model/model.h"

namespace viewer {

/// Reads models in a background thread. A new request cancels the previous one.
class Loader {
 public:
  /// @param wake  called from the background thread when a result is available
  explicit Loader(std::function<void()> wake) : wake_(std::move(wake)) {}
  ~Loader();
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;

  struct Result {
    std::vector<std::filesystem::path> files;
    std::shared_ptr<const Model> model;  ///< null when reading failed
    std::exception_ptr failure;          ///< error; null when reading succeeded
    bool isReload = false;               ///< value of `isReload` in the call of open()
  };
  /// Starts to read files. Cancels a request in progress.
  /// @param resolution  voxels along the longest side of a mesh
  void open(const std::vector<std::filesystem::path>& files, long resolution, bool isReload);
  [[nodiscard]] bool isLoading() const { return job_ != nullptr; }
  [[nodiscard]] double progress() const;
  /// Returns the result of the newest request once, when it is complete; otherwise nothing.
  [[nodiscard]] std::optional<Result> take();

 private:
  struct Job;
  std::function<void()> wake_;
  std::shared_ptr<Job> job_;
};

}  // namespace viewer
