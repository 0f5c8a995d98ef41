#pragma once

#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "apps/viewer/model/model.h"

namespace viewer {

/// Reads models in the background. Only the newest request counts.
class Loader {
 public:
  /// @param wake  called from another thread when there is a result
  explicit Loader(std::function<void()> wake) : wake_(std::move(wake)) {}
  ~Loader();
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;

  struct Result {
    std::vector<std::filesystem::path> files;
    std::shared_ptr<const Model> model;  ///< null: see failure
    std::exception_ptr failure;
    bool isReload = false;
  };
  /// Starts to read files and cancels a read in progress.
  void open(const std::vector<std::filesystem::path>& files, long resolution, bool isReload);
  [[nodiscard]] bool isLoading() const { return job_ != nullptr; }
  [[nodiscard]] double progress() const;
  /// Result of the read, once it is complete.
  [[nodiscard]] std::optional<Result> take();

 private:
  struct Job;
  std::function<void()> wake_;
  std::shared_ptr<Job> job_;
};

}  // namespace viewer
