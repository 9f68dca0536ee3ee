// A web server for one folder, on this machine alone: what a browser asks for is read from disk, one answer a
// connection.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>

namespace lumi {

class StaticServer {
 public:
  // Throws std::runtime_error where no port is to be had.
  explicit StaticServer(std::filesystem::path folder);
  ~StaticServer();
  StaticServer(const StaticServer&) = delete;
  StaticServer& operator=(const StaticServer&) = delete;

  std::string Url(const std::string& file) const;
  long bytes_sent() const { return bytes_; }

 private:
  void Serve();
  void Answer(int connection);

  std::filesystem::path folder_;
  int socket_ = -1, port_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<long> bytes_{0};
  std::thread thread_;
};

}  // namespace lumi
