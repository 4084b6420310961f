// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Concurrent;
using System.Collections.Generic;
using System.Threading;
using System.Threading.Tasks;

namespace StereoCell.Editor
{
    /// <summary>Runs an asynchronous method to its end on this thread, because an importer must return the finished
    /// result.</summary>
    static class RunHere
    {
        public static T ToEnd<T>(Func<Task<T>> method)
        {
            var before = SynchronizationContext.Current;
            var here = new Continuations();
            SynchronizationContext.SetSynchronizationContext(here);
            try
            {
                var task = method();
                task.ContinueWith(_ => here.Close(), TaskScheduler.Default);
                here.Run();
                return task.GetAwaiter().GetResult();
            }
            finally
            {
                SynchronizationContext.SetSynchronizationContext(before);
            }
        }

        sealed class Continuations : SynchronizationContext
        {
            readonly BlockingCollection<KeyValuePair<SendOrPostCallback, object>> waiting =
                new BlockingCollection<KeyValuePair<SendOrPostCallback, object>>();

            public override void Post(SendOrPostCallback d, object state)
            {
                waiting.Add(new KeyValuePair<SendOrPostCallback, object>(d, state));
            }

            public void Run()
            {
                foreach (var each in waiting.GetConsumingEnumerable()) each.Key(each.Value);
            }

            public void Close()
            {
                waiting.CompleteAdding();
            }
        }
    }
}
