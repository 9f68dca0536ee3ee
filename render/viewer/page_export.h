// Exports the scene as a web page, by lumi-export on a thread of its own, while the window stays responsive.
#pragma once

#include <atomic>
#include <exception>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "scene/program/progress.h"

namespace lumi {

class PageExport {
 public:
  // proxy: its name in the scene, or a mesh file. effects: as --effects takes them. file: FILE.html, or a folder for a
  // web server.
  PageExport(std::filesystem::path scene, std::string proxy, std::string effects, std::filesystem::path file);
  ~PageExport();  // waits until it ended
  PageExport(const PageExport&) = delete;
  PageExport& operator=(const PageExport&) = delete;

  bool ended() const { return ended_; }
  const std::filesystem::path& file() const { return file_; }
  std::string task() const;  // its current task, "encoding photos 12/24"
  // Once it ended: the page's megabytes; throws lumi-export's error if it failed.
  double Result() const;

 private:
  class Listener;
  void Work(const std::filesystem::path& scene, const std::string& proxy, const std::string& effects);
  void SayTask(const std::string& task);

  const std::filesystem::path file_;
  mutable std::mutex mutex_;
  std::string task_;
  std::exception_ptr problem_;
  double mb_ = 0;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace lumi
