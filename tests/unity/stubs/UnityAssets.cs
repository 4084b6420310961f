// Stub of UnityEditor's asset database. It follows Unity's documentation. An asset is imported when it is new, when it
// changes, or when an asset that it depends on changes. It is also imported when the registered hash of one of its custom
// dependencies changes.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Security.Cryptography;
using System.Text;
using UnityEditor.AssetImporters;
using UnityEngine;
using Object = UnityEngine.Object;

namespace UnityEditor
{
    public class AssetImporter : Object
    {
        public struct SourceAssetIdentifier
        {
            public SourceAssetIdentifier(Type type, string name) { this.type = type; this.name = name; }
            public Type type;
            public string name;
        }
        readonly Dictionary<SourceAssetIdentifier, Object> map = new Dictionary<SourceAssetIdentifier, Object>();
        public string assetPath { get; internal set; }
        public static AssetImporter GetAtPath(string path) { return AssetDatabase.ImporterOf(path); }
        public void AddRemap(SourceAssetIdentifier identifier, Object externalObject) { map[identifier] = externalObject; }
        public bool RemoveRemap(SourceAssetIdentifier identifier) { return map.Remove(identifier); }
        public Dictionary<SourceAssetIdentifier, Object> GetExternalObjectMap() { return new Dictionary<SourceAssetIdentifier, Object>(map); }
        public void SaveAndReimport() { AssetDatabase.ImportAsset(assetPath); }
    }

    public class AssetDatabase
    {
        sealed class Imported
        {
            public AssetImporter Importer;
            public AssetImportContext Context;
            public byte[] Source;
            public Dictionary<string, Hash128> Hashes;
        }
        static readonly Dictionary<string, Imported> assets = new Dictionary<string, Imported>();
        static readonly Dictionary<string, Hash128> registered = new Dictionary<string, Hash128>();
        static bool isImporting;

        public static readonly Dictionary<string, string[]> Dependencies = new Dictionary<string, string[]>();  // only in the stub: of scenes
        public static readonly List<string> Log = new List<string>();  // only in the stub: imported paths, in order
        public static AssetImportContext ContextOf(string path) { return assets[path].Context; }

        internal static AssetImporter ImporterOf(string path) { return assets.ContainsKey(path) ? assets[path].Importer : null; }

        public static void RegisterCustomDependency(string dependency, Hash128 hashOfValue)
        {
            if (isImporting) throw new InvalidOperationException("dependencies can't be registered during an import");
            registered[dependency] = hashOfValue;
        }

        public static void Refresh()
        {
            foreach (var path in Directory.GetFiles("Assets", "*", SearchOption.AllDirectories).Select(path => path.Replace('\\', '/')).OrderBy(path => path, StringComparer.Ordinal))
            {
                if (ImporterTypeOf(path) == null) continue;
                Imported found;
                if (assets.TryGetValue(path, out found) && found.Source.SequenceEqual(File.ReadAllBytes(path)) && found.Hashes.All(pair => pair.Value.Equals(HashOf(pair.Key)))) continue;
                ImportAsset(path);
            }
        }

        static Hash128 HashOf(string dependency)
        {
            Hash128 hash;
            registered.TryGetValue(dependency, out hash);
            return hash;
        }

        static Type ImporterTypeOf(string path)
        {
            return AppDomain.CurrentDomain.GetAssemblies().SelectMany(assembly => assembly.GetTypes()).FirstOrDefault(type =>
                type.GetCustomAttributes(typeof(ScriptedImporterAttribute), false).Cast<ScriptedImporterAttribute>().Any(each => path.EndsWith("." + each.Ending)));
        }

        public static void ImportAsset(string path)
        {
            Imported asset;
            if (!assets.TryGetValue(path, out asset)) assets.Add(path, asset = new Imported { Importer = (AssetImporter)Activator.CreateInstance(ImporterTypeOf(path)) });
            asset.Importer.assetPath = path;
            asset.Context = new AssetImportContext { assetPath = path };
            asset.Source = File.ReadAllBytes(path);
            var before = Snapshot();
            isImporting = true;
            ((ScriptedImporter)asset.Importer).OnImportAsset(asset.Context);
            isImporting = false;
            if (!before.SequenceEqual(Snapshot())) throw new InvalidOperationException("the import of " + path + " wrote into the project");
            asset.Hashes = asset.Context.CustomDependencies.ToDictionary(name => name, HashOf);
            Log.Add(path);
        }

        static IEnumerable<string> Snapshot()
        {
            return Directory.GetFiles("Assets", "*", SearchOption.AllDirectories).OrderBy(path => path, StringComparer.Ordinal).Select(path => path + File.GetLastWriteTimeUtc(path).Ticks).ToArray();
        }

        public static T LoadAssetAtPath<T>(string assetPath) where T : Object
        {
            return assets.ContainsKey(assetPath) ? assets[assetPath].Context.mainObject as T : null;
        }
        public static bool DeleteAsset(string path) { File.Delete(path); return assets.Remove(path); }
        public static string GenerateUniqueAssetPath(string path)
        {
            var stem = path.Substring(0, path.LastIndexOf('.'));
            var found = path;
            for (var i = 1; File.Exists(found); i++) found = stem + " " + i + path.Substring(stem.Length);
            return found;
        }
        public static string AssetPathToGUID(string path)
        {
            using (var md5 = MD5.Create()) return BitConverter.ToString(md5.ComputeHash(Encoding.UTF8.GetBytes(path))).Replace("-", "").ToLowerInvariant();
        }
        public static string GUIDToAssetPath(string guid) { return assets.Keys.FirstOrDefault(path => AssetPathToGUID(path) == guid) ?? ""; }
        public static string[] GetDependencies(string[] pathNames, bool recursive)
        {
            return pathNames.SelectMany(path => Dependencies.ContainsKey(path) ? Dependencies[path] : new[] { path }).ToArray();
        }
    }
}

namespace UnityEditor.AssetImporters
{
    public class ScriptedImporterAttribute : Attribute
    {
        public readonly string Ending;
        public ScriptedImporterAttribute(int version, string ext) { Ending = ext; }
    }

    public abstract class ScriptedImporter : AssetImporter
    {
        public abstract void OnImportAsset(AssetImportContext ctx);
    }

    public class ScriptedImporterEditor : Editor
    {
        protected void ApplyRevertGUI() { }
    }

    public class AssetImportContext
    {
        public readonly SortedDictionary<string, Object> Objects = new SortedDictionary<string, Object>(StringComparer.Ordinal);  // only in the stub
        public readonly List<string> CustomDependencies = new List<string>();
        public readonly List<string> SourceDependencies = new List<string>();
        public readonly List<string> Errors = new List<string>();
        public readonly List<string> Warnings = new List<string>();
        public string assetPath { get; internal set; }
        public Object mainObject { get; private set; }
        public void AddObjectToAsset(string identifier, Object obj)
        {
            if (obj == null) throw new ArgumentNullException("obj");
            Objects.Add(identifier, obj);
        }
        public void SetMainObject(Object obj)
        {
            if (!Objects.ContainsValue(obj)) throw new ArgumentException("not a part of the asset");
            mainObject = obj;
        }
        public void DependsOnSourceAsset(string path) { SourceDependencies.Add(path); }
        public void DependsOnCustomDependency(string dependency) { CustomDependencies.Add(dependency); }
        public void LogImportError(string msg, Object obj = null) { Errors.Add(msg); }
        public void LogImportWarning(string msg, Object obj = null) { Warnings.Add(msg); }
    }
}
