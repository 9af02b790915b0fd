#pragma once

#include <memory>
#include <string>

#include "studio/studio_core.h"

namespace gamer {

/// Serves the page and its WebSocket on 127.0.0.1, in the thread that calls run(). It outlives the
/// core, whose threads send to its sockets.
class Server {
 public:
  /// Throws RunError where the port is in use, and what make_secrets() throws.
  explicit Server(const StudioOptions& options);
  ~Server();
  Server& operator=(Server&&) = delete;

  std::string address() const;  ///< "http://127.0.0.1:PORT/?token=..."
  void run(StudioCore& core);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gamer
