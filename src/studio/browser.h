#pragma once

#include <string>

namespace gamer {

/// Opens an address in the user's browser where there is a display; nothing happens where there is
/// no xdg-open. The address contains a secret, which the list of processes would show. The browser
/// therefore gets the path of a file that only this user may read.
void open_browser(const std::string& address);

}  // namespace gamer
