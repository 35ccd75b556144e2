#include "tools/mimesis/log/export.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "common/error.h"

namespace mimesis::tool {

std::string FileNames::unique(const std::string& name, const std::string& extension) {
  std::string stem;
  for (const char c : name) stem += c == '/' || c == '\\' || c == '\0' ? '_' : c;
  if (stem.empty() || stem.starts_with('.')) stem = "_" + stem;  // no hidden file, no ".."
  std::string file = stem + extension;
  for (int i = 2; !taken_.insert(file).second; ++i)
    file = fmt::format("{}_{}{}", stem, i, extension);
  return file;
}

ExportResult export_attachments(const std::vector<OpenLog>& logs, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw ConfigError("cannot make folder '" + folder + "': " + error.message());
  ExportResult result;
  FileNames names;
  for (const OpenLog& log : logs) {
    for (const log::AttachmentIndex& index : log.summary.attachments) {
      std::string data;
      const auto attachment = log::read_attachment(*log.source, index, data);
      if (!attachment) {
        ++result.failures;
        std::cerr << fmt::format("{}: attachment {}: {}\n", log.path, index.name,
                                 attachment.error().reason);
        continue;
      }
      const std::filesystem::path name = std::filesystem::path(index.name).filename();
      const auto path = std::filesystem::path(folder) /
                        names.unique(name.stem().string(), name.extension().string());
      errno = 0;
      std::ofstream file(path, std::ios::binary);
      file << data;
      file.close();
      if (!file) throw ConfigError("cannot write '" + path.string() + "': " + std::strerror(errno));
      ++result.items;
      result.files.push_back(path.string());
    }
  }
  return result;
}

}  // namespace mimesis::tool
