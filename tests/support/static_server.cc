#include "tests/support/static_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace lumi {
namespace fs = std::filesystem;

StaticServer::StaticServer(fs::path folder) : folder_(std::move(folder)) {
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  if (socket_ < 0 || bind(socket_, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(socket_, 64) != 0 ||
      getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("no port to serve from");
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Serve(); });
}

StaticServer::~StaticServer() {
  stopping_ = true;
  thread_.join();
  close(socket_);
}

std::string StaticServer::Url(const std::string& file) const {
  return "http://127.0.0.1:" + std::to_string(port_) + "/" + file;
}

void StaticServer::Serve() {
  while (!stopping_) {
    pollfd wait{socket_, POLLIN, 0};
    if (poll(&wait, 1, 50) <= 0) continue;
    const int connection = accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) continue;
    Answer(connection);
    close(connection);
  }
}

void StaticServer::Answer(int connection) {
  std::string request;
  while (request.find("\r\n\r\n") == std::string::npos && request.size() < 65536) {
    pollfd wait{connection, POLLIN, 0};
    std::array<char, 4096> bytes{};
    if (poll(&wait, 1, 2000) <= 0) return;
    const ssize_t n = read(connection, bytes.data(), bytes.size());
    if (n <= 0) return;
    request.append(bytes.data(), static_cast<std::size_t>(n));
  }
  const std::size_t begin = request.find(" /") + 2;
  std::string name = request.substr(begin, request.find_first_of(" ?", begin) - begin);
  if (name.empty()) name = "index.html";
  std::ifstream in(folder_ / name, std::ios::binary);
  std::string answer = "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
  if (in && name.find("..") == std::string::npos) {
    std::ostringstream body;
    body << in.rdbuf();
    const std::string type = name.ends_with(".html")   ? "text/html"
                             : name.ends_with(".json") ? "application/json"
                             : name.ends_with(".jpg")  ? "image/jpeg"
                                                       : "application/octet-stream";
    answer = "HTTP/1.1 200 OK\r\nContent-Type: " + type + "\r\nContent-Length: " + std::to_string(body.str().size()) +
             "\r\nConnection: close\r\n\r\n" + body.str();
    bytes_ += static_cast<long>(body.str().size());
  }
  for (std::size_t at = 0; at < answer.size();) {
    const ssize_t n = send(connection, answer.data() + at, answer.size() - at, MSG_NOSIGNAL);
    if (n <= 0) return;
    at += static_cast<std::size_t>(n);
  }
}

}  // namespace lumi
