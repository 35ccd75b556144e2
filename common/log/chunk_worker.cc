#include "common/log/chunk_worker.h"

namespace mimesis::log {

ChunkWorker::ChunkWorker(FileBody& body) : body_(body), status_(body.status()), failed_(!status_) {
  for (std::size_t i = 0; i < kInFlight; ++i) spare_.push_back(std::make_unique<ChunkBuffer>());
  thread_ = std::thread([this] { run(); });
}

ChunkWorker::~ChunkWorker() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  to_do_.notify_one();
  thread_.join();
}

Result ChunkWorker::put(ChunkBuffer& chunk, bool flush) {
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return jobs_.size() < kInFlight; });
  if (!status_) return status_;
  std::unique_ptr<ChunkBuffer> taken;
  if (!chunk.records.empty()) {
    taken = std::move(spare_.back());
    spare_.pop_back();
    std::swap(*taken, chunk);
  }
  jobs_.push({std::move(taken), flush});
  lock.unlock();
  to_do_.notify_one();
  return {};
}

Result ChunkWorker::wait() {
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return jobs_.empty(); });
  return status_;
}

Result ChunkWorker::status() {
  if (!failed_.load(std::memory_order_relaxed)) return {};
  const std::scoped_lock lock(mutex_);
  return status_;
}

void ChunkWorker::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    to_do_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    Job& job = jobs_.front();
    lock.unlock();
    Result done;
    if (job.chunk) {
      done = body_.chunk(*job.chunk);
      job.chunk->clear();
    }
    if (done && job.flush) done = body_.flush();
    lock.lock();
    if (job.chunk) spare_.push_back(std::move(job.chunk));
    jobs_.pop();
    if (!done) {
      status_ = done;
      failed_.store(true, std::memory_order_relaxed);
    }
    done_.notify_one();
  }
}

}  // namespace mimesis::log
