// A headless Chromium that a test drives by the DevTools protocol, over two pipes; WebGL on the CPU.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace lumi {

class Chromium {
 public:
  // Whether there is one on this machine.
  static bool IsThere();

  // A window of so many CSS pixels. Throws std::runtime_error where it does not start.
  Chromium(int width_px, int height_px);
  ~Chromium();
  Chromium(const Chromium&) = delete;
  Chromium& operator=(const Chromium&) = delete;

  // Throws std::runtime_error with the browser's own words where it cannot.
  nlohmann::json Command(const std::string& method, const nlohmann::json& parameters = nlohmann::json::object());
  void Open(const std::string& url);
  // The value of an expression; of a promise, what it comes to. Throws std::runtime_error with what the page threw.
  nlohmann::json Evaluate(const std::string& expression);
  // Until the expression is true; false after so many seconds.
  bool WaitFor(const std::string& expression, double seconds = 60);
  void Screenshot(const std::filesystem::path& png);

  std::string Version();  // "Chrome/130.0.6723.58"
  // Of all its processes: what they have in memory, shared pages divided among them.
  double MemoryMb() const;

  // Addresses that pages asked for since Open, and what they wrote on the console as an error, or threw.
  const std::vector<std::string>& requests() const { return requests_; }
  const std::vector<std::string>& errors() const { return errors_; }

 private:
  nlohmann::json Read(const std::string& asked);
  void Note(const nlohmann::json& event);
  nlohmann::json Send(const std::string& method, const nlohmann::json& parameters, bool to_page);

  int pid_ = -1, to_ = -1, from_ = -1;
  long last_id_ = 0;
  std::string buffer_, session_;
  std::filesystem::path profile_;
  std::vector<std::string> requests_, errors_;
};

std::string FromBase64(const std::string& text);

}  // namespace lumi
