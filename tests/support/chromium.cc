#include "tests/support/chromium.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace lumi {
namespace fs = std::filesystem;
using nlohmann::json;
namespace {

constexpr int kAnswerMs = 120'000;  // a shader on the CPU takes seconds to compile, more on a busy machine

fs::path Program() {
  const char* path = std::getenv("PATH");
  std::string folders = path != nullptr ? path : "/usr/bin";
  for (std::size_t begin = 0; begin <= folders.size();) {
    const std::size_t end = std::min(folders.find(':', begin), folders.size());
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
      if (const fs::path file = fs::path(folders.substr(begin, end - begin)) / name; access(file.c_str(), X_OK) == 0)
        return file;
    begin = end + 1;
  }
  return {};
}

[[noreturn]] void Start(const fs::path& program, const std::vector<std::string>& arguments, int in, int out) {
  // The protocol's descriptors, out of each other's way first.
  const int a = fcntl(in, F_DUPFD, 10), b = fcntl(out, F_DUPFD, 10);
  dup2(a, 3);
  dup2(b, 4);
  const int nothing = open("/dev/null", O_RDWR);
  for (const int fd : {0, 1, 2}) dup2(nothing, fd);
  setpgid(0, 0);
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  _exit(127);
}

}  // namespace

bool Chromium::IsThere() { return !Program().empty(); }

Chromium::Chromium(int width_px, int height_px) {
  std::string folder = (fs::temp_directory_path() / "lumi-chromium-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("cannot make a folder for the browser's profile");
  profile_ = folder;
  std::array<int, 2> down{}, up{};
  if (pipe2(down.data(), O_CLOEXEC) != 0 || pipe2(up.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const std::vector<std::string> arguments = {
      "--headless=new",
      "--no-sandbox",
      "--use-gl=angle",
      "--use-angle=gl-egl",
      "--ignore-gpu-blocklist",
      "--disable-dev-shm-usage",
      "--hide-scrollbars",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--remote-debugging-pipe",
      "--user-data-dir=" + profile_.string(),
      "--window-size=" + std::to_string(width_px) + "," + std::to_string(height_px)};
  const fs::path program = Program();
  pid_ = fork();
  if (pid_ == 0) Start(program, arguments, down[0], up[1]);
  close(down[0]);
  close(up[1]);
  to_ = down[1];
  from_ = up[0];
  const json target = Send("Target.createTarget", {{"url", "about:blank"}}, false);
  session_ = Send("Target.attachToTarget", {{"targetId", target["targetId"]}, {"flatten", true}}, false)["sessionId"];
  for (const char* domain : {"Page", "Runtime", "Network", "Log"}) Command(std::string(domain) + ".enable");
  // Headless windows are smaller than asked for by what would be their frame.
  Command("Emulation.setDeviceMetricsOverride",
          {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

Chromium::~Chromium() {
  try {
    Send("Browser.close", json::object(), false);
  } catch (const std::exception&) {
  }
  close(to_);
  close(from_);
  for (int i = 0; i < 100 && waitpid(pid_, nullptr, WNOHANG) == 0; ++i) {
    if (i == 50) kill(-pid_, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  std::error_code ec;
  fs::remove_all(profile_, ec);
}

json Chromium::Read(const std::string& asked) {
  std::size_t end = buffer_.find('\0');
  while (end == std::string::npos) {
    pollfd wait{from_, POLLIN, 0};
    if (poll(&wait, 1, kAnswerMs) <= 0) throw std::runtime_error("the browser does not answer: " + asked);
    std::array<char, 65536> bytes{};
    const ssize_t n = read(from_, bytes.data(), bytes.size());
    if (n <= 0) throw std::runtime_error("the browser ended");
    const std::size_t searched = buffer_.size();  // answers may hold megabytes, in thousands of pieces
    buffer_.append(bytes.data(), static_cast<std::size_t>(n));
    end = buffer_.find('\0', searched);
  }
  const json message = json::parse(buffer_.substr(0, end));
  buffer_.erase(0, end + 1);
  return message;
}

void Chromium::Note(const json& event) {
  const std::string method = event.value("method", "");
  const json& p = event.value("params", json::object());
  if (method == "Network.requestWillBeSent") requests_.push_back(p["request"]["url"]);
  if (method == "Runtime.exceptionThrown") errors_.push_back(p["exceptionDetails"].dump());
  if (method == "Runtime.consoleAPICalled" && p["type"] == "error") errors_.push_back(p["args"].dump());
  if (method == "Log.entryAdded" && p["entry"]["level"] == "error") errors_.push_back(p["entry"]["text"]);
}

json Chromium::Send(const std::string& method, const json& parameters, bool to_page) {
  json message = {{"id", ++last_id_}, {"method", method}, {"params", parameters}};
  if (to_page) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t n = write(to_, text.data() + at, text.size() - at);
    if (n <= 0) throw std::runtime_error("the browser ended");
    at += static_cast<std::size_t>(n);
  }
  constexpr std::size_t kSaid = 200;  // of a command, in a message
  for (;;) {
    const json answer = Read(text.substr(0, std::min(text.size() - 1, kSaid)));
    if (answer.value("id", 0L) != last_id_) {
      Note(answer);
      continue;
    }
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return answer["result"];
  }
}

json Chromium::Command(const std::string& method, const json& parameters) { return Send(method, parameters, true); }

void Chromium::Open(const std::string& url) {
  requests_.clear();
  errors_.clear();
  Command("Page.navigate", {{"url", url}});
}

json Chromium::Evaluate(const std::string& expression) {
  const json result =
      Command("Runtime.evaluate", {{"expression", expression}, {"awaitPromise", true}, {"returnByValue", true}});
  if (result.contains("exceptionDetails")) throw std::runtime_error(result["exceptionDetails"].dump());
  return result["result"].value("value", json());
}

bool Chromium::WaitFor(const std::string& expression, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    if (Evaluate("!!(" + expression + ")") == true) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

std::string Chromium::Version() { return Send("Browser.getVersion", json::object(), false)["product"]; }

double Chromium::MemoryMb() const {
  std::map<int, std::vector<int>> children;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::ifstream in(entry.path() / "stat");
    std::string stat;
    if (!std::getline(in, stat)) continue;
    std::istringstream after(stat.substr(stat.rfind(')') + 1));  // names may hold anything
    std::string state;
    int parent = 0;
    after >> state >> parent;
    children[parent].push_back(std::atoi(entry.path().filename().c_str()));
  }
  double kb = 0;
  std::vector<int> open{pid_};
  while (!open.empty()) {
    const int pid = open.back();
    open.pop_back();
    for (const int child : children[pid]) open.push_back(child);
    std::ifstream in("/proc/" + std::to_string(pid) + "/smaps_rollup");
    for (std::string line; std::getline(in, line);)
      if (line.starts_with("Pss:")) kb += std::atof(line.c_str() + 4);
  }
  return kb * 1024 / 1e6;
}

void Chromium::Screenshot(const fs::path& png) {
  const std::string bytes = FromBase64(Command("Page.captureScreenshot", {{"format", "png"}})["data"]);
  std::ofstream(png, std::ios::binary) << bytes;
}

std::string FromBase64(const std::string& text) {
  std::string bytes;
  unsigned value = 0;
  int bits = 0;
  for (const char c : text) {
    const int digit = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                      : c == '/'             ? 63
                                             : -1;
    if (digit < 0) continue;
    value = value << 6 | static_cast<unsigned>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<char>(value >> bits & 0xffU));
  }
  return bytes;
}

}  // namespace lumi
